"""The version of clpt that is installed."""

from importlib import metadata

try:
    VERSION = metadata.version("clpt")
except metadata.PackageNotFoundError:  # a checkout that is not installed
    VERSION = "0.0.0"
