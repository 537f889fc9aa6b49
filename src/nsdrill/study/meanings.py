"""What each key of the study file means that no model has a say in, in one line. The
template, the JSON Schema and the documentation read this.

A test holds the names equal to those of the dataclasses.
"""

from __future__ import annotations

MEANINGS: dict[str, str] = {
    "title": "Title of the study, put on figures and in the results file",
    "model": "The model of the string",
    "sweep": "What is varied",
    "sweep.depth": "Depths",
    "sweep.wob": "Weights on bit",
    "sweep.rotary_speed": "Speeds of the top drive",
    "sweep.procedure": "Start each point from the same state, or carry the state up, down, or "
    "both ways",
    "sweep.along": "The axis along which the state is carried; needed where several are swept",
    "sweep.refine": "How often the spacing of axes {from, to, points} is halved where the "
    "responses differ",
    "continue": "What is followed by continuation, stable or not: for nsdrill continue",
    "continue.along": "The number that is continued: rotary_speed or any other by its key",
    "continue.from": "One end of its range",
    "continue.to": "The other end",
    "continue.seeds": "A results file whose settled points are followed, or values at which a "
    "motion settles first",
    "continue.motions": "What is followed: periodic (steady drilling, bounces), rolling, "
    "stick_slip",
    "continue.lobes": "The periods that are tried, in lobes, the shortest first",
    "continue.switch": "Whether branches that spring from doublings, branch points and Hopf "
    "points are followed too",
    "continue.points": "How many points a branch has at most",
    "continue.curves": "Curves of special points in a second number",
    "continue.curves.over": "The second number",
    "continue.curves.from": "One end of its range",
    "continue.curves.to": "The other end",
    "continue.curves.of": "Which points are followed: lift_off, wall, fold, doubling, torus, hopf",
    "continue.curves.points": "How many points a curve has at most",
    "uncertain": "Numbers that are not known, each with its distribution, by key; every point is "
    "run with many samples",
    "uncertain.samples": "How many samples are drawn; every operating point is run with the same "
    "ones",
    "uncertain.seed": "Another number draws other samples",
    "uncertain.design": "saltelli: samples x (unknowns + 2), from which Sobol indices follow "
    "without assumptions",
    "uncertain.correlations": "Rank correlations of pairs of unknowns, [[KEY, KEY, 0.5], ...]",
    "uncertain.table": "Joint samples in place of distributions, {KEY: [value, ...], ...}; each "
    "row is a sample",
    "simulation": "How each point is integrated",
    "simulation.transient": "Time before the motion is observed",
    "simulation.observe": "Time observed",
    "simulation.rtol": "Relative tolerance of a step",
    "simulation.max_steps": "Steps after which a run is given up",
    "simulation.verify": "Check every point with a smaller tolerance and a longer run; takes some "
    "4 times as long",
    "simulation.pair": "Pair of the explicit method; dormand_prince is the RK45 of SciPy",
    "simulation.method": "Integration of friction; implicit for steep friction",
    "classify": "From where a response counts as critical",
    "classify.bit_bounce": "Bit-bounce; the bounds of its severity must ascend",
    "classify.bit_bounce.lift_off_fraction": "Fraction of time off the rock above which it is "
    "bit-bounce",
    "classify.bit_bounce.light_fraction": "Severity: light above this fraction of time off the "
    "rock",
    "classify.bit_bounce.moderate_fraction": "Severity: moderate above this",
    "classify.bit_bounce.strong_fraction": "Severity: strong above this",
    "classify.bit_bounce.severe_fraction": "Severity: severe above this",
    "classify.stick_slip": "Stick-slip; the bounds of its severity must ascend",
    "classify.stick_slip.stick_slip_index": "Index (max - min) / (2 mean) of bit speed above "
    "which it is stick-slip",
    "classify.stick_slip.oscillation_index": "Severity: torsional oscillation from here",
    "classify.stick_slip.medium_index": "Severity: medium from here",
    "classify.stick_slip.stall_index": "Severity: onset of full stall from here",
    "classify.stick_slip.severe_index": "Severity: severe from here",
    "classify.whirl": "Whirl; the bounds of its severity must ascend",
    "classify.whirl.wall_contact_fraction": "Fraction of time on the wall above which it is whirl",
    "classify.whirl.rolling_tolerance": "Distance of the rolling ratio from one within which it "
    "is backward rolling",
    "classify.whirl.rolling_contact": "Least fraction of time on the wall for backward rolling",
    "classify.whirl.direction": "Size of the whirl ratio below which the direction is called "
    "irregular",
    "classify.whirl.light_acceleration": "Severity: light above this r.m.s. lateral acceleration",
    "classify.whirl.moderate_acceleration": "Severity: moderate above this",
    "classify.whirl.strong_acceleration": "Severity: strong above this",
    "classify.whirl.severe_acceleration": "Severity: severe above this",
    "classify.settled": "Settled motion",
    "classify.settled.tolerance": "Largest difference between the halves of the observed window, "
    "over the range",
    "classify.trust": "Trust, where points were checked",
    "classify.trust.tolerance": "Largest difference of the features between a run and its checks, "
    "in natural scales",
    "classify.motion": "Kind of motion, from the returns to the Poincare section",
    "classify.motion.absolute": "Two returns are the same within this, in natural scales of the "
    "states",
    "classify.motion.relative": "and this, in parts of the range of the returns",
    "classify.motion.longest_period": "Longest period looked for, in returns",
    "classify.motion.exponent": "Lyapunov exponent, less two errors, above which it is chaotic",
    "classify.motion.exponent_error": "Two errors of the exponent up to which zero within them is "
    "quasi-periodic",
    "classify.motion.chaotic_above": "Without an exponent: 0-1 test above which it is chaotic",
    "classify.motion.regular_below": "Without an exponent: 0-1 test below which it is regular",
    "classify.attractors": "Attractors, where every operating point has several starts",
    "classify.attractors.tolerance": "Distance of scaled features within which two starts are on "
    "the same attractor",
    "classify.attractors.matching": "Distance within which attractors of neighbouring operating "
    "points have one number",
    "classify.stuck_below": "Bit speed below which the bit counts as stuck",
    "record": "What is kept of each point beside the features",
    "record.peaks": "Last local maxima kept of bit position, bit speed and radius",
    "record.poincare": "Last returns kept of the Poincare section; 0 for none",
    "record.section": "What the bit turns by between returns to the section",
    "record.exponent": "Measure the largest Lyapunov exponent",
}
