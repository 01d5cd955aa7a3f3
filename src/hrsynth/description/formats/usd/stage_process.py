"""Process run by :func:`untrusted.run_program`: the content of a USD stage as JSON, meshes of stages, or a binary form.
Layers are composed only from the stage's own folder."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

from hrsynth.untrusted import refuse

USD_ARRAY_ENTRIES_PRINTED_MAX = 64
"""Entries of an array beyond which only their number is returned."""
USD_PRIMS_MAX = 50_000
ENDINGS = (".usd", ".usda", ".usdc")


def require_inside(start: Path, largest: int, most: int) -> list[str]:
    """Refuse a stage whose layers lie outside of its folder, are too many or too large; return the missing ones."""
    from pxr import Sdf  # type: ignore[import-untyped]

    folder, pending, seen, size = start.resolve().parent, [Path(os.path.abspath(start))], set(), 0
    missing = []
    while pending:
        path = pending.pop()
        if path in seen:
            continue
        seen.add(path)
        size += path.stat().st_size
        if size > largest:
            refuse(f"layers too large together: expected up to {largest} bytes")
        if len(seen) > most:
            refuse(f"too many layers: expected up to {most}")
        layer = Sdf.Layer.FindOrOpen(str(path))
        if layer is None:
            refuse(f"OpenUSD does not open {path.name}")
        clips: list[str] = []

        def look(place: Any, layer: Any = layer, clips: list[str] = clips) -> None:
            if place.IsPrimPath() and layer.GetPrimAtPath(place).HasInfo("clips"):
                clips.append(str(place))

        layer.Traverse(Sdf.Path.absoluteRootPath, look)
        if clips:
            refuse(f"value clips are not read: got {clips[0]}")
        for asset in filter(None, layer.GetCompositionAssetDependencies()):  # an internal reference names none
            cure = "expected layers in the file's folder. Merge all layers with usdcat --flatten."
            other = Path(os.path.normpath(path.parent / asset)) if "`" not in asset and "://" not in asset else None
            if other is None or not other.resolve().is_relative_to(folder):
                refuse(f"layer outside of the file's folder: got {asset}, {cure}")
            elif other.suffix.lower() not in ENDINGS:
                refuse(f"not a USD file as a layer: got {asset}, expected {', '.join(ENDINGS)}")
            elif other.is_file():
                pending.append(other)
            else:
                missing.append(asset)
    return missing


def convert_to_json(value: Any) -> Any:
    """Return a value of USD as one of JSON: quaternions as w x y z, matrices as rows, long arrays as their number."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if hasattr(value, "GetImaginary"):
        return [float(value.GetReal()), *map(float, value.GetImaginary())]
    if hasattr(value, "path") and hasattr(value, "resolvedPath"):
        return value.path
    try:
        if len(value) > USD_ARRAY_ENTRIES_PRINTED_MAX:
            return {"count": len(value)}
        return [convert_to_json(each) for each in value]
    except TypeError:
        return str(value)


def read_colour(prim: Any) -> Any:
    """Return the colour of a shape, or of the placeholder of a missing mesh: its display colour, else that of its bound
    preview surface."""
    from pxr import UsdGeom, UsdShade

    own, clear = (
        each.ComputeFlattened() if (each := UsdGeom.PrimvarsAPI(prim).GetPrimvar(name)) else None
        for name in ("displayColor", "displayOpacity")
    )
    try:
        if own:
            return [*map(float, own[0]), float(clear[0]) if clear else 1.0] if len(own) == 1 else None
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        shader = material.ComputeSurfaceSource()[0] if material else None
        colour = shader.GetInput("diffuseColor").Get() if shader and shader.GetInput("diffuseColor") else None
        return None if colour is None else [*map(float, colour), 1.0]
    except (TypeError, ValueError):  # values that are no colours
        return None


def describe_stage(stage: Any) -> dict[str, Any]:
    """Return the stage's units and all relevant prims: shapes, joints, and prims with a schema of UsdPhysics."""
    from pxr import Usd, UsdGeom, UsdPhysics

    found, cache = [], UsdGeom.XformCache()
    for number, prim in enumerate(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())):
        if number > USD_PRIMS_MAX:
            refuse(f"too many prims: expected up to {USD_PRIMS_MAX}")
        kind, apis = str(prim.GetTypeName()), [str(each) for each in prim.GetAppliedSchemas()]
        relations = {str(each.GetName()): [str(to) for to in each.GetTargets()] for each in prim.GetRelationships()}
        shape, joint = prim.IsA(UsdGeom.Gprim), kind.endswith("Joint") and "physics:body1" in {**relations}
        joint = joint or prim.IsA(UsdPhysics.Joint) or "physics:body0" in relations
        own = [
            each
            for each in prim.GetAttributes()
            if shape or joint or any("Physics" in api for api in apis) or each.GetName().startswith("hrsynth:")
        ]
        found.append(
            {
                "path": str(prim.GetPath()),
                "name": str(prim.GetName()),
                "type": kind,
                "apis": apis,
                "shape": shape,
                "joint": joint,
                "relations": relations,
                "values": {str(each.GetName()): convert_to_json(each.Get()) for each in own},
                "X": convert_to_json(cache.GetLocalToWorldTransform(prim)) if prim.IsA(UsdGeom.Xformable) else None,
                "colour": read_colour(prim) if shape or prim.HasAttribute("hrsynth:mesh") else None,
                "guide": shape and UsdGeom.Imageable(prim).ComputePurpose() == "guide",
            }
        )
    root = stage.GetDefaultPrim()
    return {
        "prims": found,
        "name": str(root.GetName()) if root else "",
        "metres": UsdGeom.GetStageMetersPerUnit(stage),
        "metres_told": UsdGeom.StageHasAuthoredMetersPerUnit(stage),
        "kilograms": UsdPhysics.GetStageKilogramsPerUnit(stage),
        "up": str(UsdGeom.GetStageUpAxis(stage)),
    }


def write_obj(stage: Any, path: str) -> str:
    """Return a mesh as the text of an .obj file."""
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(path))
    points, counts, corners = (
        each.Get() or []
        for each in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    turn = -1 if mesh.GetOrientationAttr().Get() == "leftHanded" else 1
    lines, at = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points], 0
    for count in counts:
        face = list(corners[at : at + count])[::turn]
        if any(not 0 <= corner < len(points) for corner in face) or len(face) < count:
            refuse(f"the faces of mesh {path} name points that do not exist")
        lines.append("f " + " ".join(str(corner + 1) for corner in face))
        at += count
    return "\n".join(lines) + "\n"


def main(largest: str, most: str, task: str, name: str, *rest: str) -> None:
    """Run one task on one file."""
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        refuse(f"OpenUSD's package does not load: {error}")
    try:
        texts = []
        for each, prims in json.load(sys.stdin).items() if task == "meshes" else [(name, [])]:
            missing = require_inside(Path(each), int(largest), int(most))
            stage = Usd.Stage.Open(each)
            texts.append([write_obj(stage, prim) for prim in prims])
        if task == "binary":
            stage.GetRootLayer().Export(rest[0])
        else:
            json.dump({**describe_stage(stage), "missing": missing} if task == "prims" else texts, sys.stdout)
        sys.stdout.flush()
    except (Tf.ErrorException, RuntimeError, OSError) as error:
        text = " ".join(str(error).split())
        what = text.partition(" : ")[2] or text or type(error).__name__
        place = re.search(r"([^'/]*):(\d+):\d+: ", what)
        refuse(
            f"OpenUSD cannot read {place[1]} from line {place[2]} on: expected a whole stage"
            if place
            else f"OpenUSD refuses it: {what[:300]}"
        )
