"""The window: `dforce gui` in a browser, made from the declarations of the parameters.

No physics, no defaults and no names of parameters live here: a new force model, experiment or setting appears by itself.
The way of the data: a field or slider gives a new `Document` (an immutable value), the `Session` keeps it and tells the
views, each `View` checks it, computes the live curve off the event loop, and hands figures to charts.

============== =====================================================================================
document       the immutable document: the case as typed, sliders, plots, results shown
typed          decimal commas and units in what is typed
values         between the values of a document and the texts of fields
fields         which fields a class of parameters has, from its declarations
session        one per browser: document, undo and redo, what is kept over a restart
results        results by identifier, on disk, with limits
compute        the newest request wins; threads for live curves; runs with progress, Stop and a queue
figures        figures as plain data for Plotly; every plot of a result is made here
plots          which quantities are drawn, of which results (picker.js); clicks on curves
kept           the results kept, as a row of names with colors (kept.js), and what differs (differences.js)
compare        names and colors of results, and the parameters in which they differ
files          the menu File: open and save (saving asks how, save.js), and files dropped (drop.js)
uploads        what a file from outside is
measured       reads a measured curve, and asks for what its file does not show; measured_session holds it with its fit
overlay        a measured curve under the lines of a figure, its best fit, and residuals
confirming     lever and tip of a measured curve, which a person confirms before a fit
fitting        which parameters a fit may find, what it says of each, and its values for the case
parameters     the numbers of a case that can be varied
explore        figures of results over parameters; parameter_study holds the one that is opened or computed here
project        a document with all its results in one file
numbers        the numbers behind the curves, as a table (numbers.js)
panels         measured_panel (measured.js) and explore_panel (explore.js) stand beside the plots
motion         the motion at a point: the tip above the sample, and traces (motion.js)
chart          the chart element (chart.js): typed arrays, zoom kept, acknowledged
entry          the element of one field (entry.js) and of one slider (slider.js)
forms          the tabs: fields, lists, choices, forces
sliders        parameters on sliders
menus          menus of titles and sentences
setpoint       the quantities at the set point (setpoint.js)
words          sentences about a case in the words of the forms
store          what a visit leaves, in a file of its own
error_messages says in a sentence why something failed
upload_checks  draw and write a result from outside once, before it replaces anything
bounds         what a document from a file may hold
view           one page of a session: forms, live curve, run bar, errors and advice at their fields
pages          the layout: header with menus, tabs at the left, plots at the right
limits         what one may ask of a server that others use too
security       secret in the address, Host and Origin, headers, sizes
server         free port, storage, start
============== =====================================================================================
"""
