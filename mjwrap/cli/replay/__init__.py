"""`mjwrap replay`: look at recordings and states."""
