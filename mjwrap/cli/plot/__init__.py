"""`mjwrap plot`: curves of muscles over a joint, with data over them."""
