#ifdef __x86_64__
#define DLSD_BATCH_ISA avx2
#define DLSD_BATCH_TARGET __attribute__((target("avx2")))
#define DLSD_BATCH_FLAG uint16_t
#include "cameras/batch_loops.h"

namespace dlsd::batch {
const Build kAvx2 = avx2::kBuild;
}
#endif
