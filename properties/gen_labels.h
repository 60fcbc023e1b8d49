#pragma once
// Draws the cases of checks/labels.h.

#include <rapidcheck.h>

#include <iosfwd>
#include <vector>

#include "properties/checks/labels.h"

namespace dlsd {

/// Draws (as `*gen` does, in a property) a scene and a realistic camera of at most 0.3 megapixels,
/// or two. A case that fails shrinks to simplerCases.
[[nodiscard]] LabelCase drawLabelCase(LabelProperty property);

/// Cases a step simpler: with fewer of the scene's parts, by halves first and at last by single
/// ones; then through a pinhole of round numbers, or with half of the image. No scene has another
/// seed, which would be another scene.
[[nodiscard]] std::vector<LabelCase> simplerCases(const LabelCase& label_case);

/// One line of JSON.
void showValue(const LabelCase& label_case, std::ostream& out);

}  // namespace dlsd
