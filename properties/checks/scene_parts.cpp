#include "properties/checks/scene_parts.h"

#include <cstddef>
#include <map>
#include <numeric>

namespace dlsd {
namespace {

/// The number of its part, for everything in a scene.
struct PartNumbers {
  std::vector<int> faces, rods, spheres, discs, tubes, edges;
  std::vector<std::vector<int>> prints;  ///< Of each face.
  int count = 0;
};

PartNumbers partNumbers(const Scene& scene) {
  const size_t rods = scene.faces.size(), spheres = rods + scene.rods.size();
  const size_t discs = spheres + scene.spheres.size(), tubes = discs + scene.discs.size();
  std::vector<size_t> leader(tubes + scene.tubes.size());
  std::iota(leader.begin(), leader.end(), size_t{0});
  const auto find = [&](size_t i) {
    while (leader[i] != i) i = leader[i] = leader[leader[i]];
    return i;
  };
  const auto join = [&](size_t a, size_t b) { leader[find(b)] = find(a); };
  for (const Edge& edge : scene.edges) {
    if (edge.face0 >= 0 && edge.face1 >= 0) {
      join(static_cast<size_t>(edge.face0), static_cast<size_t>(edge.face1));
    }
  }
  for (size_t r = 0; r < scene.rods.size(); ++r) {
    const Rod& rod = scene.rods[r];
    for (int f = rod.first_face; f < rod.first_face + rod.face_count; ++f) {
      join(rods + r, static_cast<size_t>(f));
    }
    if (!rod.isRound()) continue;
    for (int cap = rod.first_disc; cap < rod.first_disc + 2; ++cap) {
      join(rods + r, discs + static_cast<size_t>(cap));
    }
  }

  PartNumbers numbers;
  std::map<size_t, int> number_of;
  const auto append = [&](size_t begin, size_t end, std::vector<int>* list) {
    for (size_t i = begin; i < end; ++i) {
      list->push_back(
          number_of.try_emplace(find(i), static_cast<int>(number_of.size())).first->second);
    }
  };
  append(0, rods, &numbers.faces);
  append(rods, spheres, &numbers.rods);
  append(spheres, discs, &numbers.spheres);
  append(discs, tubes, &numbers.discs);
  append(tubes, leader.size(), &numbers.tubes);
  numbers.count = static_cast<int>(number_of.size());
  for (const Face& face : scene.faces) {
    numbers.prints.emplace_back(face.decals.size());
    for (int& number : numbers.prints.back()) number = numbers.count++;
  }
  // Each rectangle brought four edges, in the order of the face's prints.
  std::vector<size_t> print(scene.faces.size(), 0), edges_of_print(scene.faces.size(), 0);
  for (const Edge& edge : scene.edges) {
    if (edge.source != EdgeSource::kDecal) {
      numbers.edges.push_back(edge.rod >= 0 ? numbers.rods[static_cast<size_t>(edge.rod)]
                                            : numbers.faces[static_cast<size_t>(edge.face0)]);
      continue;
    }
    const auto f = static_cast<size_t>(edge.face0);
    if (edges_of_print[f] == 4) {
      ++print[f];
      edges_of_print[f] = 0;
    }
    while (scene.faces[f].decals.at(print[f]).shape != DecalShape::kRectangle) ++print[f];
    numbers.edges.push_back(numbers.prints[f][print[f]]);
    ++edges_of_print[f];
  }
  return numbers;
}

/// Erases what belongs to no part that is kept. Returns the new index of each thing, of what is
/// gone -1.
template <class Thing>
std::vector<int> keep(const std::vector<int>& part_of,
                      const std::vector<char>& is_kept,
                      std::vector<Thing>* things) {
  std::vector<int> new_index;
  std::vector<Thing> left;
  for (size_t i = 0; i < things->size(); ++i) {
    const bool stays = is_kept[static_cast<size_t>(part_of[i])] != 0;
    new_index.push_back(stays ? static_cast<int>(left.size()) : -1);
    if (stays) left.push_back((*things)[i]);
  }
  things->swap(left);
  return new_index;
}

int at(const std::vector<int>& new_index, int old) {
  return old < 0 ? -1 : new_index[static_cast<size_t>(old)];
}

}  // namespace

int partCount(const Scene& scene) {
  return partNumbers(scene).count;
}

Scene withParts(Scene scene, const std::vector<int>& kept) {
  const PartNumbers numbers = partNumbers(scene);
  std::vector<char> is_kept(static_cast<size_t>(numbers.count), 0);
  for (const int part : kept) is_kept.at(static_cast<size_t>(part)) = 1;
  for (size_t f = 0; f < scene.faces.size(); ++f) {
    keep(numbers.prints[f], is_kept, &scene.faces[f].decals);
  }
  const std::vector<int> faces = keep(numbers.faces, is_kept, &scene.faces);
  const std::vector<int> discs = keep(numbers.discs, is_kept, &scene.discs);
  const std::vector<int> rods = keep(numbers.rods, is_kept, &scene.rods);
  keep(numbers.spheres, is_kept, &scene.spheres);
  keep(numbers.tubes, is_kept, &scene.tubes);
  keep(numbers.edges, is_kept, &scene.edges);
  for (Rod& rod : scene.rods) {
    rod.first_face = rod.face_count > 0 ? at(faces, rod.first_face) : 0;
    rod.first_disc = at(discs, rod.first_disc);
  }
  for (Triangle& t : scene.triangles) t.face = at(faces, t.face);
  std::erase_if(scene.triangles, [](const Triangle& t) { return t.face < 0; });
  for (Edge& edge : scene.edges) {
    edge.face0 = at(faces, edge.face0);
    edge.face1 = at(faces, edge.face1);
    edge.rod = at(rods, edge.rod);
  }
  // Those of prints whose face is gone.
  std::erase_if(scene.edges, [](const Edge& edge) { return edge.rod < 0 && edge.face0 < 0; });
  return scene;
}

}  // namespace dlsd
