"""Models of scripts and notebooks: one function of states and parameters, from whose
signature and graph all follows that a model says of itself."""
