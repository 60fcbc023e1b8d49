#pragma once
// What a scene can do without, so that a failing case shrinks to the few things it needs.

#include <vector>

#include "synth/scene.h"

namespace dlsd {

/// Saved cases with parts carry it: raised with each change after which numbers mean other parts.
inline constexpr const char* kPartsVersion = "parts/1";

/// How many parts a scene has that can be taken out by themselves: faces that share edges (a solid,
/// the walls of a room); rods, with faces and caps; balls, discs, tubes; and, as the last ones,
/// prints, which go with their face, too.
[[nodiscard]] int partCount(const Scene& scene);

/// The scene with these of its parts alone. With all of them it is the same scene.
///
/// As presets make them: sides of cylinders and borders of shadows are edges of a view, and are
/// added after. Vertices, surfaces, lights and `pieces` (which no picture shows) stay.
/// @param kept  Numbers below partCount(scene), in ascending order.
[[nodiscard]] Scene withParts(Scene scene, const std::vector<int>& kept);

}  // namespace dlsd
