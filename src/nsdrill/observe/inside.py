"""What is inside a step: the continuous solution, and the events of a declared channel on
it, extrema and level crossings.

The velocities and accelerations of positions are known at both ends of a step, so the
quintic Hermite polynomial through these six numbers is of sixth order in the step: more
accurate than the dense output of the pair, and the same for any stepper. All
polynomials are in theta from 0 to 1 over the step, ``p`` the coefficients of their six
rising powers.
"""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import fma, inlined


@inlined
def quintic(g0, d0, c0, g1, d1, c1):
    """Coefficients p0..p5 from value g, slope times step d and second derivative times
    step squared c at both ends."""
    rise = g1 - g0
    half0, half1 = 0.5 * c0, 0.5 * c1
    p3 = fma(10.0, rise, fma(-6.0, d0, fma(-4.0, d1, fma(-3.0, half0, half1))))
    p4 = fma(-15.0, rise, fma(8.0, d0, fma(7.0, d1, fma(3.0, half0, -c1))))
    p5 = fma(6.0, rise, fma(-3.0, d0 + d1, half1 - half0))
    return g0, d0, half0, p3, p4, p5


@inlined
def rate_of(p, begin, h):
    """Coefficients of the rate of a polynomial over a step of length h, whose value at
    the beginning is known."""
    _, _, p2, p3, p4, p5 = p
    return begin, 2.0 * p2 / h, 3.0 * p3 / h, 4.0 * p4 / h, 5.0 * p5 / h, 0.0


@inlined
def lowered(p, level):
    """The polynomial less ``level``."""
    p0, p1, p2, p3, p4, p5 = p
    return p0 - level, p1, p2, p3, p4, p5


@inlined
def value(p, theta):
    """The polynomial at theta."""
    p0, p1, p2, p3, p4, p5 = p
    return fma(theta, fma(theta, fma(theta, fma(theta, fma(theta, p5, p4), p3), p2), p1), p0)


@inlined
def slope(p, theta):
    """The derivative of the polynomial by theta, at theta."""
    _, p1, p2, p3, p4, p5 = p
    return fma(theta, fma(theta, fma(theta, fma(theta, 5.0 * p5, 4.0 * p4), 3.0 * p3), 2.0 * p2), p1)


@inlined
def extreme(p, end_slope):
    """The theta of the extremum: where the slope, which has opposite signs at both
    ends, vanishes. The zero of the secant and two Newton steps.

    At an extremum the value depends on theta to second order, so an error of 1e-4 in
    theta is 1e-8 of the variation. Branch-free.
    """
    _, p1, p2, p3, p4, p5 = p
    theta = p1 / (p1 - end_slope)
    for _ in range(2):
        curvature = fma(theta, fma(theta, fma(theta, 20.0 * p5, 12.0 * p4), 6.0 * p3), 2.0 * p2)
        theta = theta - slope(p, theta) / curvature
        # In this order NaN, where the second derivative vanishes, gives a bound.
        theta = max(min(1.0, theta), 0.0)
    return theta


@inlined
def crossing(p, low, high):
    """Where the polynomial vanishes between ``low`` and ``high``, where its values have
    opposite signs.

    Newton's method, kept inside a shrinking bracket by bisection, to 1e-13.
    """
    below_at_start = value(p, low) < 0.0
    theta = 0.5 * (low + high)
    for _ in range(60):
        residual = value(p, theta)
        if (residual < 0.0) == below_at_start:
            low = theta
        else:
            high = theta
        gradient = slope(p, theta)
        next_theta = theta - residual / gradient if gradient != 0.0 else 0.5 * (low + high)
        if not (low < next_theta < high):
            next_theta = 0.5 * (low + high)
        if abs(next_theta - theta) < 1e-13:
            break
        theta = next_theta
    return theta


@inlined
def above(at_first, at_second, at_end, above_start, above_inside, above_end):
    """The part of an integral over the step that belongs to the times above a level,
    from the integrals from the start to the first and to the second place that divide
    the step there, and to the end; and whether the polynomial is above the level before
    the first, between the two and after the second. With theta in place of the
    integrals it is the fraction of the step."""
    total = at_first if above_start else 0.0
    total += at_second - at_first if above_inside else 0.0
    return total + (at_end - at_second if above_end else 0.0)


@inlined
def integral_of_cubic(g0, d0, g1, d1, theta):
    """The integral from 0 to theta of the cubic with these values and slopes by theta
    at 0 and 1."""
    rise = g1 - g0
    p2 = fma(3.0, rise, -fma(2.0, d0, d1))
    p3 = fma(-2.0, rise, d0 + d1)
    return theta * fma(theta, fma(theta, fma(theta, 0.25 * p3, p2 * (1.0 / 3.0)), 0.5 * d0), g0)


@inlined
def top_of_cubic(g0, d0, g1, d1):
    """The theta of the maximum of the cubic with these values and slopes, if it rises
    at 0 and falls at 1; else 0.5."""
    rise = g1 - g0
    p2 = fma(3.0, rise, -fma(2.0, d0, d1))
    p3 = fma(-2.0, rise, d0 + d1)
    theta = d0 / (np.sqrt(max(fma(p2, p2, -3.0 * p3 * d0), 0.0)) - p2)
    return theta if theta > 0.0 and theta < 1.0 else 0.5


@inlined
def cubic(g0, d0, g1, d1):
    """Coefficients p0..p5, the last two zero, from value g and slope times step d at
    both ends."""
    rise = g1 - g0
    return g0, d0, fma(3.0, rise, -fma(2.0, d0, d1)), fma(-2.0, rise, d0 + d1), 0.0, 0.0


@inlined
def position_and_velocity(b, i, theta, h, frame_rate, x0_, v0_, a0_, x1_, v1_, a1_):
    """Position and velocity of a pair of states of lane i at theta inside the step.
    The last arguments are the offsets of the rows of position, velocity and
    acceleration at the start (0) and at the end (1) of the step."""
    p = quintic(
        b[x0_ + i],
        h * (b[v0_ + i] + frame_rate),
        h * h * b[a0_ + i],
        b[x1_ + i],
        h * (b[v1_ + i] + frame_rate),
        h * h * b[a1_ + i],
    )
    return value(p, theta), slope(p, theta) / h - frame_rate


@inlined
def motion_of_pair(b, i, theta, h, frame_rate, x0_, v0_, a0_, x1_, v1_, a1_):
    """The same with the acceleration."""
    g0, d0, c0 = b[x0_ + i], h * (b[v0_ + i] + frame_rate), h * h * b[a0_ + i]
    p = quintic(g0, d0, c0, b[x1_ + i], h * (b[v1_ + i] + frame_rate), h * h * b[a1_ + i])
    _, _, p2, p3, p4, p5 = p
    bend = fma(theta, fma(theta, fma(theta, 20.0 * p5, 12.0 * p4), 6.0 * p3), 2.0 * p2)
    return value(p, theta), slope(p, theta) / h - frame_rate, bend / (h * h)


# Events: extrema and level crossings. One lane is handled at a time, as they are rare.

# The rows of a channel with peaks: the least value since the last maximum; the greatest
# since then, if it may become one; the prominence of a maximum at a value of zero; and
# the greatest maximum since the bit stuck, infinite as long as it has not.
LOW, HIGH, MARGIN, TOP = range(4)
NONE = -1  # no row


@inlined
def has_extremum(before, now):
    """Whether a slope changes its sign between its values ``before`` and ``now``; the
    extremum is a maximum where ``before`` is positive."""
    return (before > 0.0) != (now > 0.0)


@inlined
def lower_estimate(g0, g1, d0, d1, h):
    """A conservative estimate of the least value inside a step of length h of a
    quantity with one extremum there, from values g and slopes d at both ends. (A least
    value above the level has no effect and need not be located.)"""
    return min(g0, g1) - h * max(abs(d0), abs(d1))


@inlined
def next_peak(low, high, top, stuck, slip):
    """What a maximum ``high`` adds to the peaks, where ``low`` is the least value since
    the maximum before it: whether there is a peak, its height, whether those so far
    are dropped, and the next ``top``.

    As long as the quantity has not been at or below ``stuck``, every maximum is a peak.
    From then on only the greatest of each cycle is: between two such instants, and
    above ``slip``. A bit that is slower than the string's top winds the string up still,
    so a jump or a ripple below that speed is a part of sticking. The maxima before the
    first such instant belong to a cycle of which the beginning is not known.
    """
    sticks, has_stuck = low <= stuck, top < np.inf
    ends = sticks and top > slip
    is_peak = ends if has_stuck else not sticks
    return (is_peak, top if has_stuck else high, ends and not has_stuck, (high if ends else max(top, high)))


@inlined
def store_peak(store, ring, peaks, height):
    """Append the ``height`` of a peak to the ring buffer of the last ``peaks`` at the
    offset ``ring`` of the store, which begins with the number of peaks so far."""
    count = int(store[ring])
    store[ring + 1 + count % max(peaks, 1)] = height
    store[ring] = float(count + 1)


@inlined
def record_maximum(store, ring, peaks, low, high, top, stuck, slip):
    """Record in the ring what the maximum ``high`` adds to the peaks. Returns the next
    ``top``; see :func:`next_peak`."""
    is_peak, height, dropped, next_top = next_peak(low, high, top, stuck, slip)
    if dropped and peaks > 0:
        store[ring] = 0.0
    if is_peak and peaks > 0:
        store_peak(store, ring, peaks, height)
    return next_top


@inlined
def update_peaks(b, store, i, W, current, stuck, slip, low_, growth_, ring, peaks):
    """Process the next value, ``current``, of a channel of lane i with peaks. A
    greatest value becomes a maximum as soon as the quantity has fallen by the
    prominence below it; :func:`next_peak` decides, with ``stuck`` and ``slip``, what
    is a peak. ``low_`` is the offset of the channel's rows LOW, HIGH, MARGIN and TOP,
    ``growth_`` that of the relative prominence; the last ``peaks`` are stored in the
    ring at ``ring``. (The packed loop does the same where no maximum results.)"""
    low, high = b[low_ + i], b[low_ + HIGH * W + i]
    margin = fma(b[growth_ + i], abs(current), b[low_ + MARGIN * W + i])
    if high - current > margin:
        b[low_ + TOP * W + i] = record_maximum(store, ring, peaks, low, high, b[low_ + TOP * W + i], stuck, slip)
        b[low_ + i] = current
        b[low_ + HIGH * W + i] = -np.inf
    else:
        b[low_ + i] = min(low, current)
        b[low_ + HIGH * W + i] = max(high, current) if current - low > margin else high


# The rows of a channel whose cycles are counted: the least and the greatest value since
# the observation began; the middle between them while a rise above it is waited for,
# else infinite; the level below which a fall begins a cycle while one is waited for,
# else minus infinite; the time of the last rise; the range with which counting began.
CYCLE_LOW, CYCLE_HIGH, RISES, FALLS, ROSE, COUNTED_RANGE = range(6)
GROWN = 1.05  # a range that is so much larger belongs to another motion


@inlined
def fall_of_cycle(low, high, scale):
    """The level below which a cycle begins: the lower quarter of the range from ``low``
    to ``high``, and by no less than the ``scale`` below the greatest value."""
    return min(fma(0.25, high - low, low), high - scale)


@inlined
def count_cycles(b, i, W, h, time, p, begin, end, scale, least_, greatest_, low_, cycles_, cycle_time_):
    """Process a step, from the value ``begin`` to ``end``, of a channel of lane i whose
    cycles are counted, with its polynomial ``p``: each with an extremum inside, and each
    to whose end the channel has passed the level that is waited for. ``least_`` and
    ``greatest_`` are the offsets of its extremes so far, ``low_`` that of the rows from
    CYCLE_LOW on; ``cycles_`` counts the cycles, ``cycle_time_`` is their time
    together."""
    low, high = min(b[low_ + i], b[least_ + i]), max(b[low_ + CYCLE_HIGH * W + i], b[greatest_ + i])
    middle, fall = 0.5 * (low + high), fall_of_cycle(low, high, scale)
    fallen = b[low_ + RISES * W + i] < np.inf
    if not fallen:
        fallen = min(begin, end) < fall
    if fallen and end > middle:
        fallen, theta = False, 0.0
        if begin <= middle:
            theta = level_crossing(lowered(p, middle), 0.0, 1.0, False)
        now = fma(theta, h, time)
        if high - low > GROWN * b[low_ + COUNTED_RANGE * W + i]:
            b[cycles_ + i] = 0.0
            b[cycle_time_ + i] = 0.0
            b[low_ + COUNTED_RANGE * W + i] = high - low
        else:
            b[cycles_ + i] += 1.0
            b[cycle_time_ + i] += now - b[low_ + ROSE * W + i]
        b[low_ + ROSE * W + i] = now
    b[low_ + i] = low
    b[low_ + CYCLE_HIGH * W + i] = high
    b[low_ + RISES * W + i] = middle if fallen else np.inf
    b[low_ + FALLS * W + i] = -np.inf if fallen else fall


@inlined
def level_crossing(p, low, high, above_at_low):
    """Where the polynomial crosses zero between ``low`` and ``high``, to 1e-13, from
    above if ``above_at_low``. Newton's method, kept inside a shrinking bracket by
    bisection. (The side is an argument, as a run may start on zero itself.)"""
    theta = 0.5 * (low + high)
    for _ in range(60):
        residual, gradient = value(p, theta), slope(p, theta)
        before = (residual > 0.0) == above_at_low
        low, high = theta if before else low, high if before else theta
        next_theta = theta - residual / gradient
        if not (low <= next_theta <= high):
            next_theta = 0.5 * (low + high)
        if abs(next_theta - theta) < 1e-13:
            break
        theta = next_theta
    return theta


@inlined
def crossings(p, theta, above0, above_inside, above1):
    """Where the polynomial crosses zero before and after ``theta``: the extremum or
    else the end, which divides the step into two parts with at most one crossing each;
    ``theta`` and 1 where it does not cross. The last arguments are its sides at the
    start, at ``theta`` and at the end."""
    first, second = theta, 1.0
    if above0 != above_inside:
        first = level_crossing(p, 0.0, theta, above0)
    if above1 != above_inside:
        second = level_crossing(p, theta, 1.0, above_inside)
    return first, second


@inlined
def measure_events(
    b, store, i, W, h, begin, p, end, end_slope, level, stuck, slip,
    followed, least_, greatest_, above_, passages_, low_, growth_, ring, peaks, every, at_ends,
):  # fmt: skip
    """Update the measurements of a channel of lane i by the events inside a step of
    length ``h``: extrema, peaks, and crossings of ``level``.

    The channel is given by its polynomial ``p``, its values ``begin`` and ``end``
    and ``end_slope``, by theta; its extremum counts where it is ``followed``; ``stuck``
    and ``slip`` are those of :func:`update_peaks`. Offsets of its rows, or NONE, are
    ``least_``, ``greatest_``, ``above_`` (the time above the level), ``passages_`` and
    ``low_`` (see :func:`update_peaks`). ``every`` maximum is a peak, or the values
    ``at_ends`` of steps are among those compared.

    Returns how the level divides the step: two values of theta, and whether the channel
    is above the level before the first, between the two, and after the second.
    """
    begin_slope = p[1]
    extremum_inside = has_extremum(begin_slope, end_slope)
    theta, at_extremum = 1.0, end
    if extremum_inside:
        theta = extreme(p, end_slope)
        at_extremum = value(p, theta)
    is_seen = extremum_inside and followed
    seen = at_extremum if is_seen else end
    if least_ != NONE:
        b[least_ + i] = min(b[least_ + i], seen)
    if greatest_ != NONE:
        b[greatest_ + i] = max(b[greatest_ + i], seen)
    if low_ != NONE:
        if is_seen:
            update_peaks(b, store, i, W, at_extremum, stuck, slip, low_, growth_, ring, peaks)
        if at_ends:
            update_peaks(b, store, i, W, end, stuck, slip, low_, growth_, ring, peaks)
    if every and is_seen and begin_slope > 0.0 and peaks > 0:
        store_peak(store, ring, peaks, at_extremum)
    above0, above1 = begin > level, end > level
    above_inside = at_extremum > level
    if not followed and above0 == above1:
        above_inside = above0
    first, second = theta, 1.0
    if above_ != NONE and (above0 != above_inside or above1 != above_inside):
        first, second = crossings(lowered(p, level), theta, above0, above_inside, above1)
        # an excursion inside the step, which the values at its ends do not show
        if passages_ != NONE and above0 == above1:
            b[passages_ + i] += 1.0
        # The packed loop has added the whole step if both ends are above.
        b[above_ + i] += h * above(first, second, 1.0, above0, above_inside, above1) - (h if above0 and above1 else 0.0)
    return first, second, above0, above_inside, above1


@inlined
def integral_above(g0, d0, g1, d1, first, second, above0, above_inside, above1):
    """The integral by theta of the cubic with values g and slopes d at both ends, over
    the part of the step above a level, less that over the whole step if both ends are
    above; the part is given as by :func:`measure_events`."""
    at_end = integral_of_cubic(g0, d0, g1, d1, 1.0)
    return above(
        integral_of_cubic(g0, d0, g1, d1, first),
        integral_of_cubic(g0, d0, g1, d1, second),
        at_end,
        above0,
        above_inside,
        above1,
    ) - (at_end if above0 and above1 else 0.0)


@inlined
def record_returns(
    b, store, i, W, h, p, end, spacing, level_,
    ring, returns, pairs, singles, start_, stage_, slope0_, slope1_, frame_rate_,
):  # fmt: skip
    """Record all states of lane i where the section's angle, the polynomial ``p``,
    reaches the next multiples of ``spacing``. The last ``returns`` are stored in the
    ring at ``ring``; then come the numbers of pairs of states and of states of first
    order, and the offsets of their rows at the start and the end of the step."""
    entry = 2 * pairs + singles + 1
    level = b[level_ + i]
    while end >= level:
        theta = crossing(lowered(p, level), 0.0, 1.0)
        count = int(store[ring])
        place = ring + 1 + entry * (count % returns)
        for k in range(pairs):
            x, a = 2 * k * W, k * W
            position, velocity = position_and_velocity(
                b, i, theta, h, b[frame_rate_ + a + i],
                start_ + x, start_ + x + W, slope0_ + a, stage_ + x, stage_ + x + W, slope1_ + a,
            )  # fmt: skip
            store[place + 2 * k] = position
            store[place + 2 * k + 1] = velocity
        for k in range(singles):
            x, a = (2 * pairs + k) * W + i, (pairs + k) * W + i
            store[place + 2 * pairs + k] = value(
                cubic(b[start_ + x], h * b[slope0_ + a], b[stage_ + x], h * b[slope1_ + a]), theta
            )
        store[place + entry - 1] = level
        store[ring] = float(count + 1)
        # Computed from the number of the multiple: in a long run repeated addition
        # would accumulate rounding errors.
        next_level = (np.rint(level / spacing) + 1.0) * spacing
        level = next_level if next_level > level else np.inf
    b[level_ + i] = level
