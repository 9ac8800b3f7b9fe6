"""Tiles: a bake in parts gives the light of one in one piece, with the error it tells."""

from __future__ import annotations
