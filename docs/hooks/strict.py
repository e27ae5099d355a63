"""Let ``mkdocs build --strict --quiet`` fail on warnings.

``--quiet`` raises the level of the logger that ``--strict`` counts the warnings of, so that the two
together accept every broken link.
"""

import logging

from mkdocs.config.defaults import MkDocsConfig


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Let warnings through to where they are counted, and shown."""
    logger = logging.getLogger("mkdocs")
    if config.strict and logger.level > logging.WARNING:
        logger.setLevel(logging.WARNING)
    return config
