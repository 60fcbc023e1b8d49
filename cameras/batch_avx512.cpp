#ifdef __x86_64__
#define DLSD_BATCH_ISA avx512
#define DLSD_BATCH_TARGET __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl")))
#define DLSD_BATCH_FLAG uint16_t
#include "cameras/batch_loops.h"

namespace dlsd::batch {
const Build kAvx512 = avx512::kBuild;
}
#endif
