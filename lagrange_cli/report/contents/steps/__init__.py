"""The steps of a derivation as sections of words and formulas, the same for every format.

Steps go in; headings, sentences and labelled display trees come out, in the order of a lecture.
Text, LaTeX and Markdown print them and decide nothing about content. Read :mod:`.board` first.
"""
