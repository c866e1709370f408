"""What a log of innovations says about the filter that wrote it."""

from navfilters.diagnosis.channels import Channel
from navfilters.diagnosis.diagnose import Diagnosis, diagnose
from navfilters.diagnosis.log_file import Log, LogError, read_log, write_log

__all__ = ["Channel", "Diagnosis", "Log", "LogError", "diagnose", "read_log", "write_log"]
