"""Languages of emitted code, each compiled or interpreted by its own tools and judged alike.

``reference`` has the values of a scene from its symbolic equations, ``drivers`` says how a language
is built, called and run; each language has a driver of its own, in a module of its name.
"""
