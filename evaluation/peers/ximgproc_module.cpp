#include "evaluation/peers/ximgproc_module.h"

const dlsd::XimgprocDetectors dlsd_ximgproc_detectors{
    [] { return cv::ximgproc::createEdgeDrawing(); },
    [] { return cv::ximgproc::createFastLineDetector(); }};
