"""A document of a derivation as sections of words and formulas, the same for every format.

Equations and the names of the parts that are wanted go in; headings, sentences, tables and labelled
display trees come out, in one order, in one of several languages. LaTeX, Typst and Markdown print
them and decide nothing about content. Read :mod:`.contents` first.
"""
