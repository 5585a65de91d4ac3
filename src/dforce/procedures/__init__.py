"""How experiments are carried out: one file, one procedure, a function that an experiment names."""
