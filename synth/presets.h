#pragma once
// The presets behind makeSceneView. A preset's version changes whenever a seed gives another scene.

#include <string_view>

#include "synth/scene.h"

namespace dlsd {

inline constexpr std::string_view kRoomVersion = "room/1";
inline constexpr std::string_view kPaperVersion = "paper/1";
inline constexpr std::string_view kPolyhedraVersion = "polyhedra/1";

/// A furnished room, another one for each (seed, index), seen from somewhere inside.
[[nodiscard]] SceneView makeRoom(uint64_t seed, uint64_t index);

/// Two white sheets on a dark table, one scene per seed; index is time at 10 Hz on a smooth path.
[[nodiscard]] SceneView makePaper(uint64_t seed, uint64_t index);

/// Random solids in the open, all around the camera: boxes, prisms, pyramids and L-shaped blocks,
/// most of them clear of each other in the picture. Another set for each (seed, index).
[[nodiscard]] SceneView makePolyhedra(uint64_t seed, uint64_t index);

}  // namespace dlsd
