"""From light to the codes of a screen: tone curves by formula, and views of OpenColorIO."""
