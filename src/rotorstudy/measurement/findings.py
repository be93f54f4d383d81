"""Findings: what is wrong with a record, where, and what to do. Every repair is reported as one."""

from dataclasses import dataclass

SEVERITIES = ("error", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing about a record.

    severity : "error" (the record cannot be used), "warning" (used, but to be checked) or "note"
    name     : short name of the kind of finding
    where    : file, speed, node or channel
    text     : what was found, with the value and what is allowed, and what to do
    """

    severity: str
    name: str
    where: str
    text: str

    def __str__(self):
        return f"{self.severity}: {self.where}: {self.name}: {self.text}"


def errors_among(findings):
    """The findings that are errors."""
    return [finding for finding in findings if finding.severity == "error"]


def worst_first(findings):
    """Findings in the order error, warning, note; otherwise as found."""
    return sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))
