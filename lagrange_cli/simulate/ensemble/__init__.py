"""Many motions of one scene, whose members differ in parameters and initial values.

A scene and the values of its members go in; an ensemble comes out, with an accuracy for each
member. Members are stepped side by side in vector lanes where that is faster. Four rooms share the
work: :mod:`.plan` divides members into blocks, :mod:`.run` runs these, :mod:`.reduce` makes numbers
of motions, and :mod:`.store` keeps the finished blocks. Read :mod:`.plan.plan`, then
:mod:`.run.run`.
"""
