#include "evaluation/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dlsd {
namespace {

constexpr double kWidth = 460, kHeight = 300;
constexpr double kLeft = 56, kRight = 20, kTop = 34, kBottom = 48;

/// About five round numbers that cover [from, to].
std::vector<double> ticks(const PlotAxis& axis) {
  std::vector<double> values;
  if (axis.logarithmic) {
    for (int e = int(std::floor(std::log10(axis.from) + 1e-9)); e <= std::log10(axis.to) + 1e-9;
         ++e) {
      if (const double value = std::pow(10, e); value >= axis.from * (1 - 1e-9)) {
        values.push_back(value);
      }
    }
    return values;
  }
  const double raw = (axis.to - axis.from) / 5;
  const double magnitude = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * magnitude;
  for (const double candidate : {5.0, 2.0, 1.0}) {
    if (candidate * magnitude >= raw * (1 - 1e-9)) {
      step = candidate * magnitude;
    }
  }
  // Plus 0: no "-0".
  for (double k = std::ceil(axis.from / step - 1e-9) + 0.0; k * step <= axis.to + 1e-9 * step;
       ++k) {
    values.push_back(k * step);
  }
  return values;
}

std::string tickText(const PlotAxis& axis, double value) {
  return axis.percent ? fmt::format("{:g} %", std::round(value * 1e6) / 1e4)
                      : fmt::format("{:g}", std::round(value * 1e9) / 1e9);
}

/// Where a value lies on its axis, 0 to 1.
double place(const PlotAxis& axis, double value) {
  const double share = axis.logarithmic ? std::log(std::max(value, axis.from) / axis.from) /
                                              std::log(axis.to / axis.from)
                                        : (value - axis.from) / (axis.to - axis.from);
  return std::clamp(share, 0.0, 1.0);
}

std::string openSvg(const std::string& title, double height) {
  return fmt::format(
      "<svg class=\"plot\" viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" aria-label=\"{2}\">"
      "<text class=\"plot-title\" x=\"{3:g}\" y=\"18\">{2}</text>\n",
      kWidth,
      height,
      escapedHtml(title),
      kLeft);
}

}  // namespace

std::string escapedHtml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

PlotAxis shareAxis(const std::string& title, const std::vector<PlotSeries>& series) {
  double least = 1;
  for (const PlotSeries& one : series) {
    for (const PlotPoint& point : one.points) {
      least = std::min({least, point.y, point.interval ? point.interval->low : point.y});
    }
  }
  PlotAxis axis{.title = title, .from = 0, .to = 1, .percent = true};
  for (const double from : {0.5, 0.8, 0.9}) {
    axis.from = least >= from ? from : axis.from;
  }
  return axis;
}

std::string linePlot(const std::string& title,
                     const PlotAxis& x,
                     const PlotAxis& y,
                     const std::vector<PlotSeries>& series) {
  const auto n = double(x.categories.size());
  const auto atX = [&](double value) {
    const double share = n > 0 ? (value + 0.5) / n : place(x, value);
    return kLeft + share * (kWidth - kLeft - kRight);
  };
  const auto atY = [&](double value) {
    return kHeight - kBottom - place(y, value) * (kHeight - kTop - kBottom);
  };
  std::string out = openSvg(title, kHeight);
  for (const double tick : ticks(y)) {
    out += fmt::format(
        "<line class=\"grid\" x1=\"{:g}\" x2=\"{:g}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
        "<text class=\"tick\" text-anchor=\"end\" x=\"{:g}\" y=\"{:.1f}\">{}</text>\n",
        kLeft,
        kWidth - kRight,
        atY(tick),
        atY(tick),
        kLeft - 6,
        atY(tick) + 4,
        tickText(y, tick));
  }
  const auto xTick = [&](double value, const std::string& text) {
    out += fmt::format(
        "<text class=\"tick\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:g}\">{}</text>\n",
        atX(value),
        kHeight - kBottom + 16,
        escapedHtml(text));
  };
  for (size_t i = 0; i < x.categories.size(); ++i) {
    xTick(double(i), x.categories[i]);
  }
  if (x.categories.empty()) {
    for (const double tick : ticks(x)) {
      xTick(tick, tickText(x, tick));
    }
  }
  out += fmt::format(
      "<line class=\"axis\" x1=\"{0:g}\" x2=\"{1:g}\" y1=\"{2:g}\" y2=\"{2:g}\"/>"
      "<text class=\"axis-title\" text-anchor=\"middle\" x=\"{3:g}\" y=\"{4:g}\">{5}</text>"
      "<text class=\"axis-title\" text-anchor=\"middle\" transform=\"translate(13 {6:g}) "
      "rotate(-90)\">{7}</text>\n",
      kLeft,
      kWidth - kRight,
      kHeight - kBottom,
      (kLeft + kWidth - kRight) / 2,
      kHeight - 10,
      escapedHtml(x.title),
      (kTop + kHeight - kBottom) / 2,
      escapedHtml(y.title));
  for (size_t s = 0; s < series.size(); ++s) {
    // In categories several series stand side by side, so that their whiskers can be told apart.
    const double aside = x.categories.empty() ? 0
                                              : (double(s) - double(series.size() - 1) / 2) *
                                                    (series[s].joined ? 3 : 7);
    std::string path;
    for (const PlotPoint& point : series[s].points) {
      const double px = atX(point.x) + aside;
      path += fmt::format("{}{:.1f},{:.1f}", path.empty() ? "" : " ", px, atY(point.y));
      if (point.interval) {
        out += fmt::format(
            "<line class=\"whisker s{0}\" x1=\"{1:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" "
            "y2=\"{3:.1f}\"/>",
            s,
            px,
            atY(point.interval->low),
            atY(point.interval->high));
      }
      if (series[s].markers) {
        out += fmt::format(
            "<circle class=\"dot s{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\"><title>{}: "
            "{}</title></circle>",
            s,
            px,
            atY(point.y),
            escapedHtml(series[s].name),
            tickText(y, std::round(point.y * 1e3) / 1e3));
      }
    }
    if (series[s].joined) {
      out += fmt::format("<polyline class=\"curve s{}\" points=\"{}\"><title>{}</title></polyline>",
                         s,
                         path,
                         escapedHtml(series[s].name));
    }
    out += "\n";
  }
  return out + "</svg>\n";
}

std::string barPlot(const std::string& title,
                    const std::string& unit,
                    const std::vector<PlotBar>& bars) {
  constexpr double kBar = 26, kNames = 170;
  double most = 0;
  for (const PlotBar& bar : bars) {
    most = std::max(most, bar.value + bar.deviation.value_or(0));
  }
  PlotAxis axis{.title = unit, .from = 0, .to = most > 0 ? 1.05 * most : 1};
  const double bottom = kTop + kBar * double(bars.size());
  const auto atX = [&](double value) {
    return kNames + place(axis, value) * (kWidth - kNames - kRight);
  };
  std::string out = openSvg(title, bottom + 44);
  for (const double tick : ticks(axis)) {
    out += fmt::format(
        "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:g}\" y2=\"{2:g}\"/>"
        "<text class=\"tick\" text-anchor=\"middle\" x=\"{0:.1f}\" y=\"{3:g}\">{4}</text>\n",
        atX(tick),
        kTop,
        bottom,
        bottom + 16,
        tickText(axis, tick));
  }
  for (size_t i = 0; i < bars.size(); ++i) {
    const double top = kTop + kBar * double(i) + 4;
    out += fmt::format(
        "<text class=\"tick\" text-anchor=\"end\" x=\"{:g}\" y=\"{:g}\">{}</text>"
        "<rect class=\"bar s{}\" x=\"{:g}\" y=\"{:g}\" width=\"{:.1f}\" height=\"{:g}\"/>",
        kNames - 8,
        top + 13,
        escapedHtml(bars[i].name),
        bars[i].colour,
        kNames,
        top,
        atX(bars[i].value) - kNames,
        kBar - 8);
    if (bars[i].deviation) {
      out += fmt::format(
          "<line class=\"deviation\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:g}\" y2=\"{:g}\"/>",
          atX(std::max(0.0, bars[i].value - *bars[i].deviation)),
          atX(bars[i].value + *bars[i].deviation),
          top + kBar / 2 - 4,
          top + kBar / 2 - 4);
    }
    out += "\n";
  }
  out += fmt::format(
      "<text class=\"axis-title\" text-anchor=\"middle\" x=\"{:g}\" y=\"{:g}\">{}</text>",
      (kNames + kWidth - kRight) / 2,
      bottom + 36,
      escapedHtml(unit));
  return out + "</svg>\n";
}

std::string plotLegend(const std::vector<std::string>& names) {
  std::string out = "<p class=\"legend\">";
  for (size_t i = 0; i < names.size(); ++i) {
    out += fmt::format("<span><i class=\"s{}\"></i>{}</span>", i, escapedHtml(names[i]));
  }
  return out + "</p>\n";
}

const std::string_view kPlotStyle = R"css(
:root { --s0: #0b63b5; --s1: #d9480f; --s2: #2b8a3e; --s3: #9c36b5; --s4: #a07900; --s5: #c2255c; --s6: #0c8599; --s7: #5f3dc4; }
@media (prefers-color-scheme: dark) {
  :root { --s0: #74b8f5; --s1: #ff9a62; --s2: #69db7c; --s3: #da9cf0; --s4: #e8c547; --s5: #ff8fb1; --s6: #66d9e8; --s7: #b197fc; }
}
.s0 { --c: var(--s0); } .s1 { --c: var(--s1); } .s2 { --c: var(--s2); } .s3 { --c: var(--s3); }
.s4 { --c: var(--s4); } .s5 { --c: var(--s5); } .s6 { --c: var(--s6); } .s7 { --c: var(--s7); }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(400px, 100%), 1fr)); gap: 14px; margin-top: 10px; }
.plot { display: block; width: 100%; height: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; font: 12px system-ui, sans-serif; }
.plot text { fill: var(--dim); } .plot .plot-title { fill: var(--text); font-weight: 600; font-size: 13px; }
.plot .grid { stroke: var(--line); stroke-width: 1; } .plot .axis { stroke: var(--dim); stroke-width: 1; }
.plot .tick { font-size: 11px; }
.plot .curve { fill: none; stroke: var(--c); stroke-width: 1.8; stroke-linejoin: round; }
.plot .whisker { stroke: var(--c); stroke-width: 1.4; stroke-opacity: .6; } .plot .dot { fill: var(--c); } .plot .bar { fill: var(--c); }
.plot .deviation { stroke: var(--text); stroke-width: 1.4; }
.legend { display: flex; flex-wrap: wrap; gap: 4px 18px; }
.legend i { display: inline-block; width: 18px; height: 4px; border-radius: 2px; background: var(--c); vertical-align: middle; margin-right: 6px; }
)css";

}  // namespace dlsd
