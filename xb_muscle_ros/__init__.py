"""Cross-bridge muscle for robots and physiologists: fibre length and calcium in, force out."""

__version__ = "0.1.0"
