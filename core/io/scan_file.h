#pragma once

#include <filesystem>

#include "core/mesh/scan.h"

namespace shaped {

/// Reads a scan, chosen by the extension: PLY (ascii, binary of both byte orders), OBJ, OFF or STL (ascii, binary),
/// each with or without faces; .npy, N x 3 points or N x 6 points and normals; .xyz, lines of "x y z" or "x y z nx ny
/// nz". Points and faces come in the file's order and unit, nothing dropped, merged or repaired (STL corners at exactly
/// the same position become one point). Colours are skipped.
///
/// Normals come out with unit length, whatever their length in the file: from PLY's nx, ny, nz, from OFF's with the
/// keyword NOFF, from OBJ's vn where every vertex has one that is the same in all its faces (or where they are as many
/// as the vertices and stand in the same order). An OBJ whose vertices have several, or some none, is read without
/// normals, and so is STL, whose normals are those of facets.
///
/// Throws InvalidInput naming the file as readMesh does, when it has no points, and naming the vertex too when a
/// coordinate or a normal is not finite or a normal has length zero.
Scan readScan(const std::filesystem::path& path);

/// Writes a scan as PLY (binary, little-endian, doubles); it reads back exactly, normals with exact unit length. The
/// file appears only when complete.
/// Throws InvalidInput for another extension than .ply, no points, another number of normals than of points or none, a
/// coordinate that is not finite, a normal whose length differs from 1 by more than 1e-3, or a face with an index out
/// of range; FileError when writing fails.
void writeScan(const std::filesystem::path& path, const Scan& scan);

}  // namespace shaped
