"""What the benchmarks' tests may lean on."""

from verification.blender_session import blender, pytest_report_header, pytest_sessionfinish

__all__ = ["blender", "pytest_report_header", "pytest_sessionfinish"]
