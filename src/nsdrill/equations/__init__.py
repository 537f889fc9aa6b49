"""From the equations of a model, a function of plain Python, to lane code: a graph, its
derivatives, the stages of implicit friction."""
