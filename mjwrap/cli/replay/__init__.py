"""`mjwrap replay`: show recordings and tables of states."""
