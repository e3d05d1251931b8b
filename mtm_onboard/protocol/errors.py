"""The one exception that every part raises for bad input."""


class MtmError(Exception):
    """Bad input or a refused action; its text is one sentence that says what is wrong and what to do."""
