"""All muscles of a model at once: their paths, moments, wrenches on bodies, and what is drawn of them."""
