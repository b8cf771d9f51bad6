"""The colours of charts and drawings.

They are of Okabe and Ito's palette (Color Universal Design), which people with any of the usual colour blindnesses tell apart. Its yellow is left out,
because it is too faint on white. Some of the colours are alike in grey, so markers, dashes or hatching differ too."""
BLACK, BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY = "#000000", "#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9"
FAINT = "#d0d0d0"
