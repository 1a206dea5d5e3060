"""The clouds of the anatomy: how many spheres, how large, and whether they cover their surface."""

from collections.abc import Mapping

from primitives.point_cloud import PointCloud
from scenarios.check.finding import Finding, Part, Severity, amount

CHECK = "clouds"


def check_clouds(clouds: Mapping[str, PointCloud]) -> Part:
    """Points, radius and largest gap of every cloud."""
    rows, findings = [], []
    for name, cloud in clouds.items():
        gap = cloud.gap.size if cloud.gap is not None else None
        rows.append(
            {
                "name": name,
                "points": len(cloud.points),
                "added": cloud.added,
                "radius_m": cloud.radius,
                "gap_m": gap,
                "covers": None if gap is None else bool(gap <= cloud.radius),
            }
        )
        if gap is None:
            what = "its gaps were not measured; the tool may pass where they are wider than its spheres"
            advice = "make it with PointCloud.from_points or from_surface, which measure them"
            findings.append(Finding(Severity.WARNING, CHECK, name, what, advice, {"radius_m": cloud.radius}))
        elif gap > cloud.radius:
            what = f"its largest gap is {amount(gap, 'm')}, wider than its spheres of {amount(cloud.radius, 'm')}"
            advice = "fill its gaps, or cover it with larger spheres"
            numbers = {"gap_m": gap, "radius_m": cloud.radius}
            findings.append(Finding(Severity.ERROR, CHECK, name, what, advice, numbers))
        if cloud.added:
            what = f"{cloud.added} of its {len(cloud.points)} spheres were added to close gaps"
            advice = "look at them in the viewer where the file's surface matters"
            findings.append(Finding(Severity.NOTE, CHECK, name, what, advice, {"added": float(cloud.added)}))
    return Part(CHECK, rows, findings)
