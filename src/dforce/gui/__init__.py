"""The window: `dforce gui` in a browser, made from the declarations of the parameters.

No physics, no defaults and no names of parameters live here: a new force model, experiment or setting appears by itself.
The way of the data: a field or slider gives a new `Document` (an immutable value). The `Session` keeps it and notifies the
views. Each `View` checks it, computes the live curve off the event loop, and hands figures to charts.

=========== =====================================================================================
window      the page: `server` starts it, `security` guards it, `pages` is its layout, `start` its first page, `view` ties
            one page to its session, `shown` finds the parts that are behind, `dialogs` shows messages and questions,
            `address` keeps the state in the address, `classroom` is a class at one server
document    the person's input: `document` is the immutable value, `session` its history, `store` keeps it and its
            results on disk and names these, `compute` works off the event loop
case        forms and sliders: `fields` reads the declarations and puts sentences in the words of the forms, `forms` and
            `sliders` show them, `entry` has the elements (one draws an own law), `values` reads typed text
curves      `figures` and `other_figures` make every figure of a result, `states` finds and lists the states behind it,
            `chart` draws it, `plots` chooses it; `panel` is the pane below it, with `setpoint`, `motion`, `numbers` and
            `advice` as tabs; `kept` are several results
measured    `reading` takes a measured file in, `session` keeps the curve, `overlay` draws it, `fitting` has its lever and
            tip and the results of a fit, `reconstruction` is its force, `panel` shows all of it in tabs and at the fields
study       `explore` lists the choices over parameters, `pictures` draws them, `parameter_study` computes them,
            `panel` shows them
files       `file_menu` opens and saves; `uploads` checks a file and keeps the last ones, `project` packs a
            document with its results
=========== =====================================================================================
"""
