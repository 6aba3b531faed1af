"""Aided navigation: the covariance of the position error that an inertial unit with GNSS leaves over an aperture.

The inertial unit integrates its measurements between the fixes of the GNSS receiver. A Kalman filter combines both; a
smoother also uses the fixes after each moment. `timeline` defines the moments of an analysis, `error_state` describes
how errors grow between two moments, and `smoother` contains the filter and the smoother.
"""

__all__ = ("error_state", "smoother", "timeline")
