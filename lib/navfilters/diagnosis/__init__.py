"""What a log of innovations says about the filter that wrote it."""

from navfilters.diagnosis.diagnose import Channel, Diagnosis, diagnose
from navfilters.diagnosis.log_file import Log, LogError, read_log

__all__ = ["Channel", "Diagnosis", "Log", "LogError", "diagnose", "read_log"]
