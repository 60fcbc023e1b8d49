#pragma once
// The presets behind makeSceneView. A preset's version changes whenever a seed gives another scene.

#include <string_view>

#include "synth/scene.h"

namespace dlsd {

inline constexpr std::string_view kRoomVersion = "room/2";
inline constexpr std::string_view kPaperVersion = "paper/2";
inline constexpr std::string_view kPolyhedraVersion = "polyhedra/2";
inline constexpr std::string_view kWiresVersion = "wires/2";
inline constexpr std::string_view kCorridorVersion = "corridor/2";
inline constexpr std::string_view kFacadeVersion = "facade/2";
inline constexpr std::string_view kCheckerboardVersion = "checkerboard/2";

/// A furnished room, another one for each (seed, index), seen from somewhere inside.
[[nodiscard]] SceneView makeRoom(uint64_t seed, uint64_t index);

/// Two white sheets on a dark table, one scene per seed; index is time at 10 Hz on a smooth path.
[[nodiscard]] SceneView makePaper(uint64_t seed, uint64_t index);

/// Random solids in the open, all around the camera: boxes, prisms, pyramids and L-shaped blocks,
/// most of them clear of each other in the picture. Another set for each (seed, index).
[[nodiscard]] SceneView makePolyhedra(uint64_t seed, uint64_t index);

/// Free-standing wireframes of random polyhedra, thin rods with balls at the corners, all around
/// the camera in a large plain hall. Another set for each (seed, index).
[[nodiscard]] SceneView makeWires(uint64_t seed, uint64_t index);

/// A corridor with doors, handrails, tiles, lamps and boxes; its long lines pass the camera to
/// behind it. Two lamps, most of the time with shadows. Another one for each (seed, index).
[[nodiscard]] SceneView makeCorridor(uint64_t seed, uint64_t index);

/// A house front of repeated windows and balconies under a sun that casts shadows, seen from the
/// paved place before it. Another one for each (seed, index).
[[nodiscard]] SceneView makeFacade(uint64_t seed, uint64_t index);

/// Calibration boards around the camera, black squares on white, in a plain hall with a lamp that
/// casts shadows. Other boards for each (seed, index).
[[nodiscard]] SceneView makeCheckerboard(uint64_t seed, uint64_t index);

}  // namespace dlsd
