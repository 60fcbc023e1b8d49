#pragma once
// What of OpenCV's ximgproc is no virtual function: ximgproc_module.cpp has it, which is loaded
// when such a detector is made.

#include <opencv2/core.hpp>
#include <opencv2/ximgproc/edge_drawing.hpp>
#include <opencv2/ximgproc/fast_line_detector.hpp>

namespace dlsd {

struct XimgprocDetectors {
  cv::Ptr<cv::ximgproc::EdgeDrawing> (*edgeDrawing)();
  cv::Ptr<cv::ximgproc::FastLineDetector> (*fastLineDetector)();
};

}  // namespace dlsd

extern "C" const dlsd::XimgprocDetectors dlsd_ximgproc_detectors;
