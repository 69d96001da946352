"""Who is in control: the helm's state, manual override, and the pair of a primary and a stand-by helm
(helm.md 9.1, 9.2, 9.5)."""

from __future__ import annotations

OVERRIDE_VARIABLES = ("MOOS_MANUAL_OVERRIDE", "MOOS_MANUAL_OVERIDE")


class Authority:
    """`state` is the text of IVPHELM_STATE."""

    def __init__(self, in_drive: bool, allow_park: bool = True, standby: float = 0.0) -> None:
        self.driving = in_drive
        self.allow_park = allow_park
        self.malconfig = False
        self.disabled = False
        self.standby = standby
        """Seconds without a heartbeat after which a stand-by helm takes over; 0 for a primary one."""
        self.took_over = False
        self._heartbeat: float | None = None

    @property
    def state(self) -> str:
        if self.malconfig:
            return "MALCONFIG"
        if self.disabled:
            return "DISABLED"
        if self.standby > 0.0 and not self.took_over:
            return "STANDBY"
        return ("DRIVE" if self.driving else "PARK") + ("+" if self.took_over else "")

    @property
    def awake(self) -> bool:
        """Whether it iterates at all (DRIVE or PARK, with or without a plus)."""
        return not (self.malconfig or self.disabled or (self.standby > 0.0 and not self.took_over))

    def override(self, value: object) -> bool:
        """An override message: text TRUE parks, FALSE gives control; returns whether that changed anything."""
        word = value.strip().strip('"').lower() if isinstance(value, str) else ""
        before = self.driving
        if word == "false":
            self.driving = True
        elif word == "true" and self.allow_park:
            self.driving = False
        return self.driving != before

    def park(self) -> None:
        """Give up control, if that is allowed."""
        if self.allow_park:
            self.driving = False

    def hear(self, state: str, now: float) -> str:
        """Another helm's IVPHELM_STATE; returns ``takeover`` if this helm is replaced, ``refresh`` if a helm
        that took over should show itself in full, else an empty text."""
        if self.standby > 0.0:
            if self.took_over:
                return "refresh"
            self._heartbeat = now
            return ""
        if state != "STANDBY" and not self.malconfig and not self.disabled:
            self.disabled = True
            return "takeover"
        return ""

    def watch(self, now: float) -> bool:
        """A stand-by helm takes over when the primary's last heartbeat is too old; True at that moment."""
        if self.standby <= 0.0 or self.took_over or self._heartbeat is None or self.malconfig:
            return False
        self.took_over = now - self._heartbeat > self.standby
        return self.took_over
