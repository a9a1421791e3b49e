"""What the peer benchmarks share: one JSON line a measurement, the median, the memory high-water mark."""
import json
import os
import resource
import time

RESULTS = os.environ.get("PEER_RESULTS", "peer_results.jsonl")


def peak_rss_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def emit(**kw):
    for k, v in list(kw.items()):
        if isinstance(v, float):
            kw[k] = float(f"{v:.6g}")
    kw["utc"] = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    line = json.dumps(kw, default=float)
    print("RESULT " + line, flush=True)
    with open(RESULTS, "a") as f:
        f.write(line + "\n")


def median(xs):
    xs = sorted(xs)
    n = len(xs)
    return 0.5 * (xs[(n - 1) // 2] + xs[n // 2])
