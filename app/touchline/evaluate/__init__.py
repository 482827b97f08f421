"""What a fit is worth: residuals, distortion, cross-validation, and the report that says it in millimetres.

fit/      residuals, distortion (Eq. 9), cross-validation, expected error, and the report of them all
cameras/  whether the cameras of a pair or a rig agree where they see the same
drift/    whether a camera still stands as it did, and when that is an alarm
"""
