"""A lens from what is straight in the world: edges in images, and balls that roll over the field.

problem.py       distances of points from the curves that a lens makes of straight lines
search.py        the lens that makes given chains of points straight
fit.py           the same where some chains are not straight, with its covariance
bow.py           how far the lens bows edges, and whether the edges themselves are bowed
straightness.py  from images and clicked lines to a report
rolls.py         how far rolls of a ball bow, and the report on that
rolling.py       from frames to rolls, and from rolls to a lens or a refined calibration
"""
