"""The decks of studies run by OpenSees: its corotational beams, contact by penalty, its arc-length method.

    python3 -m unilat.opensees [-o FILE] [--set NAME=VALUE] deck.inp        # openseespy comes from PyPI

It writes a result file as unilat does, so that errors and times of both are held against the same exact values. Cards
that it cannot carry over are refused.
"""
