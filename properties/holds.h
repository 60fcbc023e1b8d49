#pragma once
// Runs a RapidCheck property as a part of a GoogleTest test: on a share of RC_PARAMS' number of
// cases, with a limit of the time that shrinking takes, and without most cases being discarded.

#include <functional>

namespace dlsd {

/// Checks the property (which draws with `*gen` and judges with RC_ASSERT, RC_FAIL, RC_PRE) on
/// `share` of the cases that RC_PARAMS asks for, at least 10. Fails the running test if the
/// property does not hold, or if more cases are discarded than judged. Whatever is thrown is a
/// failure. The first case that fails is shrunk for DLSD_SHRINK_SECONDS (an environment variable; 5
/// if there is none). Returns how many cases were judged, discarded ones left out, up to and with
/// the first failure.
long holds(double share, const std::function<void()>& property);

}  // namespace dlsd
