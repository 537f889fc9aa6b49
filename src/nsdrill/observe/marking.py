"""The marks of a run as a declared observer attends to them: the observation begins, is
half over, ends."""

from __future__ import annotations

from nsdrill.abi import CONTROL
from nsdrill.observe.channel_text import MARK, PEAK_ROWS, ChannelText, indented
from nsdrill.observe.channels import Extremes, Winding
from nsdrill.observe.inside import HIGH, LOW, MARGIN, TOP


class MarkerText(ChannelText):
    """Lines of the marker, for one lane, whose state and outputs are in the rows of the
    step's end."""

    def lines(self) -> list[str]:
        """The body of the marker."""
        channels_with_peaks, width, states = (
            self.declaration.channels_with_peaks,
            len(self.declaration.measured_per_half),
            len(self.names.states),
        )
        first_half = self.lanes * (
            self.rows.observer + min((self.row_of[key] for key in self.declaration.measured_per_half), default=0)
        )
        texts = self.row_texts[MARK]
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            f"ring_size = {len(channels_with_peaks)} * (peaks + 1)",
            f"section_size = 1 + {states + 1} * returns if {int(bool(self.declaration.section))} "
            f"and returns > 0 else 0",
            "rings, section = RINGS + i * ring_size, RINGS + W * ring_size + i * section_size",
            "if mark == OPENS:",
            *indented(self._opening_lines()),
            "else:",
            *indented(self._completing_lines()),
            f"    first = column if mark != CLOSES else column + {width}",
            f"    for k in range({width}):",
            f"        outcome[first + k] = b[{first_half} + k * W + i]",
            "    if mark == CLOSES:",
            *indented(self._closing_lines(), 2),
            "        for k in range(ring_size):",
            f"            outcome[column + {2 * width} + k] = store[rings + k]",
            "        for k in range(section_size):",
            f"            outcome[column + {2 * width} + ring_size + k] = store[section + k]",
            f"for k in range({width}):",
            f"    b[{first_half} + k * W + i] = 0.0",
        ]
        for name in self.declaration.channels_of(Extremes):
            lines.append(f"now = {self._code(self._channel(name).value, texts)}")
            lines += [f"{self._own_row(end, name)} = now" for end in self.declaration.ends_of(name)]
        for winding in self.declaration.of_kind(Winding):
            if winding.counted:
                lines.append(f"{self._own_row('angle_before', winding.name)} = {self._angle(winding)}")
        return lines

    def _opening_lines(self) -> list[str]:
        """The lines that empty the rings, and begin the peaks and the section."""
        texts = self.row_texts[MARK]
        lines = [
            "for k in range(ring_size):",
            "    store[rings + k] = 0.0",
            "for k in range(section_size):",
            "    store[section + k] = 0.0",
            f"tolerances = PROMINENCE / {self._row(self.rows.control + CONTROL.index('per_rtol'))}",
            f"{self._own_row('growth')} = tolerances",
        ]
        for name in self.declaration.channels_with_peaks:
            if (LOW, name) in self.row_of:
                channel = self._channel(name)
                lines += [
                    f"{self._own_row(LOW, name)} = {self._code(channel.value, texts)}",
                    f"{self._own_row(HIGH, name)} = -np.inf",
                    f"{self._own_row(TOP, name)} = np.inf",
                    f"{self._own_row(MARGIN, name)} = tolerances * {self._scale_text(channel)}",
                ]
        if self.declaration.section:
            angle = self._channel(self.declaration.section.channel)
            lines += [
                f"spacing, angle = {self._spacing()}, {self._code(angle.value, texts)}",
                f"{self._own_row('level')} = np.inf",
                "if returns > 0 and spacing > 0.0:",
                f"    {self._own_row('level')} = (np.floor(angle / spacing) + 1.0) * spacing",
            ]
        return lines

    def _angle(self, winding: Winding) -> str:
        """The angle of the vector at a mark within its half plane, from 0 to pi."""
        x, y = (self._code(self._channel(name).value, self.row_texts[MARK]) for name in (winding.x, winding.y))
        return f"math.atan2({y}, {x}) + (math.pi if {y} < 0.0 else 0.0)"

    def _completing_lines(self) -> list[str]:
        """The lines that complete at a mark what is not compared at each step: extremes
        of smooth channels, and angles of which only half revolutions are counted."""
        lines = []
        for name in self.declaration.channels_of(Extremes):
            found = self.declaration.extremes_of(name)
            if found is None or not found.smooth:
                continue
            value = self._channel(name).value
            lines.append(f"now = {self._code(value, self.row_texts[MARK])}")
            for end in self.declaration.ends_of(name):
                row = self._own_row(end, name)
                lines.append(f"{row} = {'min' if end == 'least' else 'max'}({row}, now)")
        for winding in self.declaration.of_kind(Winding):
            if winding.counted:
                row, before = (self._own_row(w, winding.name) for w in ("angle", "angle_before"))
                lines.append(f"{row} = fma(math.pi, {row}, {self._angle(winding)} - {before})")
        return lines

    def _closing_lines(self) -> list[str]:
        """The lines that complete the last maximum of a smooth quantity that has by now
        fallen by the prominence below it, and the last cycle of a bit that is stuck at
        the end."""
        lines = []
        for number, name in enumerate(self.declaration.channels_with_peaks):
            if (LOW, name) not in self.row_of:
                continue
            channel, found = (self._channel(name), self.declaration.extremes_of(name))
            stuck, slip = self._slip(channel)
            low, high, margin, top = (self._own_row(part, name) for part in PEAK_ROWS)
            ring = f"rings + {number} * (peaks + 1)"
            if found and found.smooth:
                lines += [
                    f"now = {self._code(channel.value, self.row_texts[MARK])}",
                    f"if {high} - now > fma({self._own_row('growth')}, abs(now), {margin}):",
                    f"    {top} = record_maximum(store, {ring}, peaks, {low}, {high}, {top}, {stuck}, {slip})",
                    f"    {low} = now",
                    f"{low} = min({low}, now)",
                ]
            if slip != "np.inf":
                lines += [
                    f"if peaks > 0 and {low} <= {stuck} and {slip} < {top} < np.inf:",
                    f"    store_peak(store, {ring}, peaks, {top})",
                ]
        return lines
