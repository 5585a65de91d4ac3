"""The window: `dforce gui` in a browser, made from the declarations of the parameters.

No physics, no defaults and no names of parameters live here: a new force model, experiment or setting appears by itself.
The way of the data: a field or slider gives a new `Document` (an immutable value), the `Session` keeps it and tells the
views, each `View` checks it, computes the live curve off the event loop, and hands figures to charts.

=========== =====================================================================================
window      the page: `server` starts it, `security` and `limits` guard it, `pages` is its layout, `view` ties one page
            to its session, `shown` says which parts are behind, `error_messages` and `menus` speak, `address` keeps the
            state in the address, `start` and `questions` are the first page
document    what a person works on: `document` is the immutable value, `session` its history, `store` and `results`
            keep it on disk, `bounds` limits it, `compute` works off the event loop, `link` packs it for an address
case        forms and sliders: `fields` reads the declarations, `forms`, `entry` and `sliders` show them, `typed` and
            `values` read what is typed, `words` says sentences in the words of the forms
curves      `figures`, `basins_figure` and `force_figure` make every figure of a result, `states` the states behind it,
            `chart` draws it, `plots` chooses it; `panel` is the pane below it, with a file for each of its tabs; `kept` and
            `compare` are several results
measured    `reading` takes a measured curve in, `confirming` its lever and tip, `overlay` draws it, `fitting` fits it,
            `at_field` is its fit at each field, `reconstructed` draws its force, `panel` shows all of it
study       `explore` says what can be looked at over parameters, `pictures` draws it, `drawn_limit` is a limit across it,
            `parameter_study` computes it, `panel` shows it
files       `file_menu` opens and saves; `uploads` and `upload_checks` look a file through, `project` packs a document
            with its results
=========== =====================================================================================
"""
