"""Writers of reports, one a format: each prints any content in its letters and its layout.

Sections of words and formulas go in; LaTeX, Typst, Markdown, HTML or rows of the terminal come out.
Read :mod:`.markdown` first, the shortest of them.
"""
