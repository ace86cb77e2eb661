"""Random messages to each server from eight clients at once, with a real client beside them.

    python3 -m uv run python tests/benchmarks/server_noise.py [MESSAGES] [SERVER ...]

`MESSAGES` of all clients to each server together; `SERVER`: such as `"HislipServer laser"`, all of
them by default. Half of the connections to HiSLIP begin as sessions. Printed: the longest time of a
query of the real client, and the memory after the first tenth and after all (its peak).
"""

import functools
import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
CLIENTS = 8


def main(count: int = 1_000_000, *only: str) -> None:
    """Command line."""
    from noisy_clients import slowest_beside_noise

    from hardware import Bridge, HislipServer, LaserLimits, TcpServer, VisaLaserLink, VisaLink
    from hardware.simulated import (
        SimulatedAFG31052,
        SimulatedInfiniiVision,
        SimulatedLink,
        SimulatedTLB6700,
    )

    ranges = ((765.0, 781.0), (0.0, 100.0), (30.0, 140.0), (15.0, 30.0), (20.0, 40.0))

    def bridge() -> Bridge:
        behind = VisaLaserLink(SimulatedLink(SimulatedTLB6700()))
        return Bridge(behind, limits=LaserLimits(*ranges))

    made = {
        "generator": SimulatedAFG31052,
        "oscilloscope": lambda: SimulatedInfiniiVision(lambda *asked: None),
        "laser": SimulatedTLB6700,
        "bridge": bridge,
    }
    for server in (HislipServer, TcpServer):
        for name, make in made.items():
            if only and f"{server.__name__} {name}" not in only:
                continue
            alone = {"alone": True} if name == "bridge" and server is HislipServer else {}
            with server(make(), **alone) as behind:
                link = VisaLink(behind.resource, backend="@py")

                def ask(link: VisaLink = link) -> None:
                    until = link.now() + 5.0
                    link.send(b"*IDN?\n", until)
                    got = b""
                    while not got.endswith(b"\n"):
                        got += link.receive(100, until).data
                    assert len(got) > 10, got

                each = count // CLIENTS
                noise = functools.partial(
                    slowest_beside_noise, ask, (behind.host, behind.port),
                    clients=CLIENTS, sessions=server is HislipServer and not alone,
                )  # fmt: skip
                slowest = noise(messages=max(each // 10, 1))
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
                began = time.monotonic()
                slowest = max(slowest, noise(messages=each))
                after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
                link.close()
            print(
                f"{server.__name__} {name}: {each * CLIENTS} messages in "
                f"{time.monotonic() - began:.0f} s; slowest query {slowest * 1e3:.0f} ms; memory "
                f"{before:.1f} MB, then {after:.1f} MB",
                flush=True,
            )


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:2]), *sys.argv[2:])
