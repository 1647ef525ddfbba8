"""The paper's tables and figures from runs of the example decks: input/run paper."""
