"""The forms and sliders of a case, made from the declarations of its parameters."""
