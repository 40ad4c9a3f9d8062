"""Writers of reports, one a format: each prints any content in its letters and its layout.

Sections of words and formulas go in; LaTeX, Typst, Markdown or rows of the terminal come out. Read
:mod:`.letters` first, the letters of a format.
"""
