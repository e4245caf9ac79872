#!/usr/bin/python3
"""Writes the rigs of the real data sets as rig files (core/io/rig_file.h). Needs numpy alone.

  rig_from_data.py posed_body FOLDER OUT [full|1k]     FOLDER: .../posed_body
  rig_from_data.py body_sequences FOLDER IDENTITY POSED_BODY OUT [full|1k]
                                                       rest joints of that body in hierarchy.json, weights of posed_body
  rig_from_data.py makehuman FOLDER RIG OUT            FOLDER: .../makehuman_cc0; RIG: cmu_mb, game_engine or default

posed_body is in metres. MakeHuman's rigs are for the vertices of `base.obj` that its group `body` has (0 to 13379), in
decimetres; joints are the means of the vertices that the rig names. Weights stay as they are: the reader normalises them.
"""

import json
import pathlib
import sys

import numpy as np

BODY_VERTICES = 13380


def write(path, unit, joints, weights):
    """joints: (name, parent index or None, position) each; weights: a list of (joint, weight) a vertex."""
    number = lambda x: float(f"{x:.9g}")
    lines = [json.dumps({"name": name, "parent": parent, "rest": [number(x) for x in rest]}) for name, parent, rest in joints]
    lists = [json.dumps([[int(joint), number(weight)] for joint, weight in pairs]) for pairs in weights]
    text = '{"unit": "%s",\n"joints": [\n%s],\n"weights": [\n%s]}\n' % (unit, ",\n".join(lines), ",\n".join(lists))
    pathlib.Path(path).write_text(text)


def posed_weights(folder, size):
    """The weights of posed_body for the full topology, or for the 1k subset of its vertices."""
    arrays = np.load(folder / "rig/weights_sparse.npz")
    weights = [[] for _ in range(BODY_VERTICES)]
    for vertex, joint, weight in zip(arrays["vertex"], arrays["joint"], arrays["weight"]):
        weights[vertex].append((joint, weight))
    if size == "full":
        return weights
    return [weights[v] for v in np.load(folder / "coarse_1k/vertex_index_in_full_i32.npy")]


def joints_of(document, positions):
    return [(name, None if parent < 0 else parent, rest)
            for name, parent, rest in zip(document["joints"], document["parents"], positions)]


def posed_body(folder, out, size="full"):
    folder = pathlib.Path(folder)
    rig = json.loads((folder / "rig/rig.json").read_text())
    write(out, "m", joints_of(rig, rig["rest_joint_positions_average_adult_m"]), posed_weights(folder, size))


def body_sequences(folder, identity, posed, out, size="1k"):
    rig = json.loads((pathlib.Path(folder) / "hierarchy.json").read_text())
    rest = rig["identities"][identity]["rest_joint_positions_m"]
    write(out, "m", joints_of(rig, rest), posed_weights(pathlib.Path(posed), size))


def base_vertices(folder):
    lines = (folder / "base.obj").read_text().splitlines()
    return np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)


def makehuman_bones(folder, name):
    """Name -> (parent's name or None, indices of the vertices whose mean is the joint), and name -> [[vertex, weight]]."""
    rigs = folder / "rigs"
    if name == "default":
        rig = json.loads((rigs / "default.mhskel").read_text())
        bones = {bone: (fields["parent"], rig["joints"][fields["head"]]) for bone, fields in rig["bones"].items()}
        return bones, json.loads((rigs / "default_weights.mhw").read_text())["weights"]
    cubes = cube_vertices(folder)
    bones = {}
    for bone, fields in json.loads((rigs / f"rig.{name}.json").read_text()).items():
        head = fields["head"]
        vertices = cubes[head["cube_name"]] if head["strategy"] == "CUBE" else head["vertex_indices"]
        bones[bone] = (fields["parent"] or None, vertices)
    return bones, json.loads((rigs / f"weights.{name}.json").read_text())["weights"]


def cube_vertices(folder):
    """Group of base.obj -> its vertices, for the groups joint-*."""
    cubes, group = {}, None
    for line in (folder / "base.obj").read_text().splitlines():
        if line.startswith("g "):
            group = line[2:].strip()
        elif line.startswith("f "):
            cubes.setdefault(group, set()).update(int(corner.split("/")[0]) - 1 for corner in line.split()[1:])
    return {name: sorted(vertices) for name, vertices in cubes.items() if name.startswith("joint-")}


def parents_first(bones):
    order = []
    while len(order) < len(bones):
        order += [name for name, (parent, _) in bones.items() if name not in order and (parent is None or parent in order)]
    return order


def makehuman(folder, name, out):
    folder = pathlib.Path(folder)
    positions = base_vertices(folder)
    bones, by_bone = makehuman_bones(folder, name)
    order = parents_first(bones)
    joints = [(bone, None if bones[bone][0] is None else order.index(bones[bone][0]), positions[bones[bone][1]].mean(axis=0))
              for bone in order]
    weights = [[] for _ in range(BODY_VERTICES)]
    for bone, pairs in by_bone.items():
        for vertex, weight in pairs:
            if vertex < BODY_VERTICES and weight > 0:
                weights[vertex].append((order.index(bone), weight))
    write(out, "dm", joints, weights)


if __name__ == "__main__":
    forms = {"posed_body": posed_body, "body_sequences": body_sequences, "makehuman": makehuman}
    if len(sys.argv) < 4 or sys.argv[1] not in forms:
        sys.exit(__doc__)
    forms[sys.argv[1]](*sys.argv[2:])
