"""The Small Size League's standard pattern: a team's dot in the middle, four dots that tell number and front.

Dots are counted counter-clockwise from the robot's front: front left, rear left, rear right, front right. Facts of the
league's rules, Standard Pattern, numbers 0 to 15.
"""

from math import atan2, hypot

TEAM_DOT_MM = 50.0  # diameter
DOT_MM = 40.0
# mm ahead of the robot's middle and to its left
DOTS_MM = ((35.0, 54.8), (-54.8, 35.0), (-54.8, -35.0), (35.0, -54.8))
DOTS_AT_MM = hypot(*DOTS_MM[0])  # all four are as far out
# from the front, counter-clockwise
DOT_ANGLES = tuple(atan2(left, ahead) for ahead, left in DOTS_MM)
# Whether each dot is green, else pink; the place in the table is the number.
GREEN = tuple(
    tuple(letter == "g" for letter in word)
    for word in (
        "pgpp",
        "ggpp",
        "ggpg",
        "pgpg",
        "ppgp",
        "gpgp",
        "gpgg",
        "ppgg",
        "gggg",
        "pppp",
        "pggp",
        "gppg",
        "gggp",
        "gppp",
        "pggg",
        "pppg",
    )
)
NUMBER_OF = {dots: number for number, dots in enumerate(GREEN)}
