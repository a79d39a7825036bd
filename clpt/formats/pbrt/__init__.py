"""Scenes in PBRT version 4's format."""
