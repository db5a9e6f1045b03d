// SLIPSTREAM_WIDE before a function: compiled twice, the wider for processors that have it; chosen when the program starts (which
// sanitizers do not survive). Without contraction and reductions both give the same bits.
#pragma once

#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SLIPSTREAM_WIDE [[gnu::target_clones("avx2", "default"), gnu::flatten]]
#else
#define SLIPSTREAM_WIDE
#endif
