"""Sentences about the scene and the geometry of the collection."""

SCENE_SENTENCES: dict[str, str] = {
    "same-at-the-edge": "the declared errors have the same quadratic phase at the edge and at the centre",
    "drift-is-open-at-the-edge": (
        "{row_ids:list}: the drift of free-running oscillators since they were set is not counted: the file does "
        "not state how they were set"
    ),
    "largest-at-the-edge": "largest between the centre and azimuth {azimuth_deg:.0f} deg, {radius:m} away",
    "one-correction-serves": "autofocus correction valid {how_far}, within the total of {total:limit rad}",
    "over-at-the-edge": "{row_id} is {phase:rad} at the scene's edge, {limit:limit rad} allowed",
    "path-curves": (
        "the {platform}'s path is curved: the published model assumes a straight path, the full model does not"
    ),
    "sight-turns": (
        "the {platform}'s line of sight turns by ±{half_turn:.2g} rad: the published model assumes a quadratic "
        "phase, the full model does not"
    ),
    "image-may-have-several-peaks": (
        "{loss_db:.3g} dB by the declared errors; above 3 dB an image may have several peaks, and phase and "
        "location hold for the point with the smallest phase variance"
    ),
    "direct-path-is-the-clock": (
        "the direct path is the clock: the full model uses ranges less the distance between the platforms, and "
        "timing errors have no effect; the published model ignores the direct path"
    ),
}
