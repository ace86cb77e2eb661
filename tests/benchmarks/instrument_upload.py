"""Seconds of an upload to the simulated generator over TCP and HiSLIP, through pyvisa-py.

    uv run --extra lab python tests/benchmarks/instrument_upload.py

Uploads of few packets are where a delayed acknowledgement (44 ms) would show.
"""

import time

import numpy as np


def main(repeats=20):
    """Command line."""
    from hardware import HislipServer, Scpi, TcpServer, VisaLink
    from hardware.generator._port import AfgPort
    from hardware.simulated import SimulatedAFG31052

    print("wires         points    median ms   slowest ms   (with *OPC?, *ESR?, errors, length)")
    for wires in (TcpServer, HislipServer):
        with wires(SimulatedAFG31052()) as server:
            session = Scpi(VisaLink(server.resource, backend="@py"))
            port = AfgPort(session, 1)
            session.identify(".*")
            for points in (2, 100, 1000, 2000, 4000, 16384, 131072):
                codes = (np.arange(points) % 16383).astype(np.uint16)
                seconds = []
                for _ in range(repeats):
                    began = time.perf_counter()
                    port.upload(codes)
                    seconds.append(time.perf_counter() - began)
                assert (port.read_back(points) == codes).all()
                middle, slowest = np.median(seconds) * 1e3, max(seconds) * 1e3
                print(f"{wires.__name__:12}  {points:6d}  {middle:10.2f}  {slowest:10.2f}")
            session.close()


if __name__ == "__main__":
    main()
