"""The window: `dforce gui` in a browser, made from the declarations of the parameters.

No physics, no defaults and no names of parameters live here: a new force model, experiment or setting appears by itself.
The way of the data: a field or slider gives a new `Document` (an immutable value), the `Session` keeps it and tells the
views, each `View` checks it, computes the live curve off the event loop, and hands figures to charts.

=========== =====================================================================================
window      the page: `server` starts it, `security` guards it, `pages` is its layout, `start` its first page, `view` ties
            one page to its session, `shown` says which parts are behind, `dialogs` speaks and asks, `address` keeps the
            state in the address, `classroom` is a class at one server
document    what a person works on: `document` is the immutable value, `session` its history, `store` keeps it and its
            results on disk and tells these apart, `compute` works off the event loop
case        forms and sliders: `fields` reads the declarations and says sentences in the words of the forms, `forms` and
            `sliders` show them, `entry` has the elements (one draws an own law), `values` reads what is typed
curves      `figures` and `other_figures` make every figure of a result, `states` finds and lists the states behind it,
            `chart` draws it, `plots` chooses it; `panel` is the pane below it, with `setpoint`, `motion`, `numbers` and
            `advice` as tabs; `kept` are several results
measured    `reading` takes a measured file in, `session` keeps the curve, `overlay` draws it, `fitting` has its lever and
            tip and what a fit found, `reconstruction` is its force, `panel` shows all of it in tabs and at the fields
study       `explore` says what can be looked at over parameters, `pictures` draws it, `parameter_study` computes it,
            `panel` shows it
files       `file_menu` opens and saves; `uploads` looks a file through and keeps the last ones, `project` packs a
            document with its results
=========== =====================================================================================
"""
