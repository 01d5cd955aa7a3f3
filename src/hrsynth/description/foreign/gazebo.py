"""``<gazebo><joint>``: a joint of SDFormat inside a URDF closes a loop where its child is at the zero pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...geometry.vectors import inverse
from .. import xml
from . import sdf_joint
from .assembly import Assembly
from .graph import Graph

if TYPE_CHECKING:
    from .urdf import Reader

VERSION = (1, 6)
"""The version whose conventions Gazebo takes for what stands inside a URDF."""


def read(reader: Reader, graph: Graph) -> None:
    """Add the joints of all ``<gazebo>`` elements to the graph."""
    found = [joint for gazebo in reader.root.findall("gazebo") for joint in gazebo.findall("joint")]
    if not found:
        return
    carried = {edge.links[1] for edge in graph.edges.values()}
    base = next((link for link in graph.links if link not in carried), next(iter(graph.links)))
    tree = Assembly(base, [edge for edge in graph.edges.values() if edge.in_tree])
    poses = tree.placed(tree.zero())
    for element in found:
        links = [sdf_joint.text(element, tag) for tag in ("parent", "child")]
        if None in links or links[0] == links[1]:
            reader.defect(xml.line(element), "joint of <gazebo> without two links", element.get("name"))
            continue
        if not all(reader.known(link, xml.line(element), "joint of <gazebo>: unknown link") for link in links):
            continue
        parent, child = (str(link) for link in links)
        if parent not in poses or child not in poses:
            reader.defect(xml.line(element), "joint of <gazebo>: a link that hangs on nothing", element.get("name"))
            continue
        X_MJ = poses[child] @ sdf_joint.pose_of(reader, element.find("pose"))
        places = sdf_joint.Places(inverse(poses[parent]) @ X_MJ, inverse(poses[child]) @ X_MJ, X_MJ, np.eye(3))
        sdf_joint.add(reader, graph, element, (parent, child), places, VERSION, in_tree=False)
    sdf_joint.gears_named(reader, graph)
    graph.note_assumed()
