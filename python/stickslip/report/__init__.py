"""The report: everything about a scene on one HTML page that needs no network."""

from stickslip.report.findings import Findings, findings
from stickslip.report.page import page, write_report

__all__ = ["Findings", "findings", "page", "write_report"]
