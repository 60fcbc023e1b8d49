#pragma once
// Plots as inline SVG. Colours come from the page's style sheet (kPlotStyle): series i has the
// class s0, s1, ...

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "evaluation/bootstrap.h"

namespace dlsd {

struct PlotPoint {
  double x = 0, y = 0;
  std::optional<Interval> interval{};  ///< Of y.
};

struct PlotSeries {
  std::string name;
  std::vector<PlotPoint> points;
  bool markers = true;
  bool joined = true;  ///< By lines: not where categories have no order.
};

struct PlotAxis {
  std::string title;
  double from = 0, to = 1;
  bool logarithmic = false;
  bool percent = false;                   ///< Numbers are shares.
  std::vector<std::string> categories{};  ///< If any: x is an index into them.
};

/// An axis of shares from 0, 50, 80 or 90 % on, so that no point or interval lies below.
[[nodiscard]] PlotAxis shareAxis(const std::string& title, const std::vector<PlotSeries>& series);

/// Points, joined by lines or not, with whiskers for intervals. Points outside the axes are clamped
/// to them.
[[nodiscard]] std::string linePlot(const std::string& title,
                                   const PlotAxis& x,
                                   const PlotAxis& y,
                                   const std::vector<PlotSeries>& series);

struct PlotBar {
  std::string name;
  double value = 0;
  std::optional<double> deviation{};  ///< A whisker of this size to both sides.
  size_t colour = 0;
};

/// Horizontal bars from 0.
[[nodiscard]] std::string barPlot(const std::string& title,
                                  const std::string& unit,
                                  const std::vector<PlotBar>& bars);

/// The series' names and colours, as HTML.
[[nodiscard]] std::string plotLegend(const std::vector<std::string>& names);

/// For HTML and SVG text and attributes.
[[nodiscard]] std::string escapedHtml(std::string_view text);

extern const std::string_view kPlotStyle;

}  // namespace dlsd
