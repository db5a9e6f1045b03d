// SIGINT and SIGTERM as a question that main loops ask: a clean end instead of a sudden one.
#pragma once

namespace slipstream {

// From now on the two signals set the flag and wake a poll that waits (no SA_RESTART). A second one ends the process at once.
void catch_interrupts();
bool interrupted();

}  // namespace slipstream
