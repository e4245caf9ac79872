"""Clean and noisy motions for row 8 of the table on curves: noisy_clips.py DATA DEST [CLIP...]

Skins a body of body_sequences by its own joint rotations, and again with noise that differs from frame to frame: `pose`, each joint
turned by a random rotation of 1 degree (standard deviation of each axis); `vertex`, each vertex displaced by 1 mm (each axis); `surface`,
a field of displacements that is smooth over some 5 cm of the surface, 2 mm (each axis), as frames captured one by one have it; `captured`,
pose and surface. Writes DEST/CLIP_{clean,pose,vertex,surface,captured}.npy (frames, 1250, 3) and the mesh DEST/CLIP.ply. With DEST/fit_TRIAL.npy, what
`shapectl fit` made of DATA/marker_trials/markers_TRIAL_f32.npy (all frames, at full resolution), also trial_TRIAL_{clean,captured}.npy. CLIP: run_muscular, walk_child and sword_muscular unless given.
"""

import json
import pathlib
import shutil
import sys

import numpy


def rotations(vectors):
    """Axis-angle vectors, any leading shape, to matrices."""
    angle = numpy.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = numpy.moveaxis(vectors, -1, 0)
    zero = numpy.zeros_like(x)
    cross = numpy.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*x.shape, 3, 3)
    safe = numpy.maximum(angle, 1e-12)
    return numpy.eye(3) + numpy.sin(angle) / safe * cross + (1 - numpy.cos(angle)) / safe ** 2 * cross @ cross


def skinned(rest, weights, joints, parents, locals_):
    """x = sum_j w_j (G_j (v - r_j) + p_j), G_j = G_parent exp(w_j), p_j = p_parent + G_parent (r_j - r_parent)."""
    frames = []
    for local in locals_:
        turns, places = [], []
        for j, parent in enumerate(parents):
            if parent < 0:
                turns.append(local[j])
                places.append(joints[j])
            else:
                turns.append(turns[parent] @ local[j])
                places.append(places[parent] + turns[parent] @ (joints[j] - joints[parent]))
        moved = numpy.einsum("jab,vjb->vja", numpy.stack(turns), rest[:, None] - joints) + numpy.stack(places)
        frames.append(numpy.einsum("vj,vja->va", weights, moved))
    return numpy.stack(frames)


def read_vertices(path, count):
    data = path.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    return numpy.frombuffer(data, "<f4", 3 * count, start).reshape(count, 3).astype(float)


def read_faces(path, vertices):
    data = path.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n") + 12 * vertices
    rows = numpy.frombuffer(data, numpy.dtype([("count", "u1"), ("corners", "<i4", 3)]), offset=start)
    return rows["corners"]


def smooth_fields(rest, faces, length, count, random):
    """Random fields (count, V, 3) that vary over `length` metres of the surface, of unit variance at each vertex."""
    edges = numpy.unique(numpy.sort(numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    near = numpy.zeros((len(rest), len(rest)))
    weights = length ** 2 / (4 * ((rest[edges[:, 0]] - rest[edges[:, 1]]) ** 2).sum(-1))
    near[edges[:, 0], edges[:, 1]] = near[edges[:, 1], edges[:, 0]] = weights
    spread = numpy.linalg.inv(numpy.diag(1 + near.sum(1)) - near)
    spread = spread @ spread
    spread /= numpy.linalg.norm(spread, axis=1, keepdims=True)
    return numpy.einsum("vw,fwa->fva", spread, random.standard_normal((count, *rest.shape)))


def main(data, dest, clips):
    data, dest = pathlib.Path(data), pathlib.Path(dest)
    dest.mkdir(parents=True, exist_ok=True)
    hierarchy = json.loads((data / "body_sequences/hierarchy.json").read_text())
    index = numpy.load(data / "posed_body/coarse_1k/vertex_index_in_full_i32.npy")
    sparse = numpy.load(data / "posed_body/rig/weights_sparse.npz")
    whole = numpy.zeros((13380, len(hierarchy["joints"])))
    numpy.add.at(whole, (sparse["vertex"], sparse["joint"]), sparse["weight"])
    weights = whole[index]
    for clip in clips:
        name, body = clip.rsplit("_", 1)
        mesh = data / f"body_sequences/rest_1k_{body}.ply"
        rest = read_vertices(mesh, len(index))
        joints = numpy.array(hierarchy["identities"][body]["rest_joint_positions_m"])
        vectors = numpy.load(data / f"body_sequences/motion_{name}_{body}_rotvec_f32.npy").astype(float)
        random = numpy.random.default_rng(7)
        clean_turns = rotations(vectors)
        noise = rotations(numpy.radians(1) * random.standard_normal(vectors.shape))
        noise[:, 0] = numpy.eye(3)  # the root's rotation changes no shape
        shake = 0.001 * random.standard_normal((len(vectors), *rest.shape))
        surface = 0.002 * smooth_fields(rest, read_faces(mesh, len(rest)), 0.05, len(vectors), random)
        clean = skinned(rest, weights, joints, hierarchy["parents"], clean_turns)
        posed = skinned(rest, weights, joints, hierarchy["parents"], clean_turns @ noise)
        truth = numpy.load(data / f"body_sequences/seq_{clip}_1k_f32.npy")
        print(f"{clip}: {len(clean)} frames; the skinning differs from the data by {abs(clean - truth).max() * 1000:.2f} mm; noise"
              f" [mm RMS]: pose {rms(posed - clean):.1f}, vertex {rms(shake):.1f}, surface {rms(surface):.1f}")
        for kind, frames in (("clean", clean), ("pose", posed), ("vertex", clean + shake), ("surface", clean + surface),
                             ("captured", posed + surface)):
            numpy.save(dest / f"{clip}_{kind}.npy", frames.astype(numpy.float32))
        shutil.copy(mesh, dest / f"{clip}.ply")
    for fit in dest.glob("fit_*.npy"):
        trial = fit.stem.removeprefix("fit_")
        fitted = numpy.load(fit)[:, index]
        truth = numpy.load(data / f"marker_trials/gt_{trial}_1k_f32.npy")
        fitted = fitted.astype(float) - fitted.mean(1, keepdims=True) + truth.mean(1, keepdims=True)
        print(f"trial {trial}: {len(fitted)} frames; noise [mm RMS] {rms(fitted - truth):.1f}, beside its mean over the frames"
              f" {rms(fitted - truth - (fitted - truth).mean(0)):.1f}")
        numpy.save(dest / f"trial_{trial}_clean.npy", truth.astype(numpy.float32))
        numpy.save(dest / f"trial_{trial}_captured.npy", fitted.astype(numpy.float32))


def rms(difference):
    return 1000 * numpy.sqrt((difference ** 2).sum(-1).mean())


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:] or ["run_muscular", "walk_child", "sword_muscular"])
