#include "detector/options.h"

#include <sstream>
#include <stdexcept>

namespace dlsd {
namespace {

void require(const char* name, double value, double lo, double hi, bool lo_included = true) {
  if (value <= hi && (lo_included ? value >= lo : value > lo)) return;
  std::ostringstream message;
  message.precision(17);
  message << "detector option " << name << " = " << value << " is out of range: allowed is "
          << (lo_included ? "[" : "(") << lo << ", " << hi << "]";
  throw std::invalid_argument(message.str());
}

}  // namespace

void EdgeDrawingOptions::check() const {
  require("edges.anchor_gradient", anchor_gradient, 0, 1000);
  require("edges.min_gradient", min_gradient, 0, anchor_gradient);
  require("edges.anchor_noise_ratio", anchor_noise_ratio, 0, 100);
  require("edges.min_noise_ratio", min_noise_ratio, 0, anchor_noise_ratio);
  require("edges.anchor_interval_px", anchor_interval_px, 1, 64);
  require("edges.min_chain_px", min_chain_px, 2, 1000);
}

void PolygonalChainOptions::check() const {
  require("polygons.max_line_err_px", max_line_err_px, 0, 100, false);
  require("polygons.min_line_px", min_line_px, 3, 1000);
  require("polygons.max_turn_rad", max_turn_rad, 0, std::numbers::pi / 2, false);
  require("polygons.min_single_px", min_single_px, 0, 10000);
}

void PlanarChainOptions::check() const {
  require("planes.seed_px", seed_px, 4, 1000);
  require("planes.max_err_px", max_err_px, 0, 100, false);
}

void ValidationOptions::check() const {
  require("validation.rho_px", rho_px, 0, 100, false);
  require("validation.tight_rho_px", tight_rho_px, 0, rho_px, false);
  require("validation.max_residual_sigmas", max_residual_sigmas, 1, 100);
  require("validation.max_gap_px", max_gap_px, 0, 1000);
  require("validation.min_bend_radius_px", min_bend_radius_px, 0, 1e9);
  require("validation.min_length_px", min_length_px, 2, 10000);
  require("validation.min_score", min_score, -100, 1e6);
}

void DetectorOptions::check() const {
  edges.check();
  polygons.check();
  planes.check();
  validation.check();
}

DetectorOptions DetectorOptions::paper() {
  DetectorOptions options;
  options.method = Method::kConvexPolygons;
  options.edges.anchor_gradient = 4;
  options.edges.min_gradient = 3;
  options.edges.anchor_noise_ratio = 0;
  options.edges.min_noise_ratio = 0;
  options.validation.rho_px = 4;
  return options;
}

}  // namespace dlsd
