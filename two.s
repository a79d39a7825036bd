
/tmp/rays_ab/pc/EL/HEAJLIGFECIOMNPKJCPOCMPNHPEHGGLHMOAFM/closest/8-1-1-goffs0-smallgrid/closest.so:     file format elf64-x86-64


Disassembly of section .text:

0000000000001000 <shear_intersect>:
1000 push   rbp
1001 mov    rbp,rsp
1004 and    rsp,0xfffffffffffffff8
1008 mov    r9d,DWORD PTR [rdi+0x8]
100c lea    eax,[r9*8+0x0]
1014 vmovss xmm0,DWORD PTR [rsi+rax*4]
1019 vmovss xmm2,DWORD PTR [rdi+0x20]
101e vsubss xmm8,xmm0,xmm2
1022 lea    eax,[r9*8+0x18]
102a vmovss xmm1,DWORD PTR [rsi+rax*4]
102f vsubss xmm10,xmm1,xmm2
1033 lea    eax,[r9*8+0x30]
103b vmovss xmm3,DWORD PTR [rsi+rax*4]
1040 vsubss xmm11,xmm3,xmm2
1044 vmovss xmm4,DWORD PTR [rdi+0xc]
1049 mov    r10d,DWORD PTR [rdi]
104c mov    r9d,DWORD PTR [rdi+0x4]
1050 lea    eax,[r10*8+0x0]
1058 vmovss xmm3,DWORD PTR [rsi+rax*4]
105d vmovss xmm7,DWORD PTR [rdi+0x18]
1062 vsubss xmm3,xmm3,xmm7
1066 vmulss xmm5,xmm8,xmm4
106a vsubss xmm9,xmm3,xmm5
106e vmovss xmm5,DWORD PTR [rdi+0x10]
1073 lea    eax,[r9*8+0x0]
107b vmovss xmm6,DWORD PTR [rsi+rax*4]
1080 vmovss xmm0,DWORD PTR [rdi+0x1c]
1085 vsubss xmm6,xmm6,xmm0
1089 vmulss xmm3,xmm8,xmm5
108d vsubss xmm6,xmm6,xmm3
1091 lea    eax,[r10*8+0x18]
1099 vmovss xmm3,DWORD PTR [rsi+rax*4]
109e vsubss xmm3,xmm3,xmm7
10a2 vmulss xmm1,xmm10,xmm4
10a6 vsubss xmm1,xmm3,xmm1
10aa lea    eax,[r9*8+0x18]
10b2 vmovss xmm3,DWORD PTR [rsi+rax*4]
10b7 vsubss xmm3,xmm3,xmm0
10bb vmulss xmm2,xmm10,xmm5
10bf vsubss xmm2,xmm3,xmm2
10c3 lea    eax,[r10*8+0x30]
10cb vmovss xmm3,DWORD PTR [rsi+rax*4]
10d0 vsubss xmm3,xmm3,xmm7
10d4 vmulss xmm4,xmm11,xmm4
10d8 vsubss xmm3,xmm3,xmm4
10dc lea    eax,[r9*8+0x30]
10e4 vmovss xmm4,DWORD PTR [rsi+rax*4]
10e9 vsubss xmm0,xmm4,xmm0
10ed vmulss xmm4,xmm11,xmm5
10f1 vsubss xmm0,xmm0,xmm4
10f5 vmulss xmm4,xmm2,xmm3
10f9 vmulss xmm5,xmm1,xmm0
10fd vsubss xmm4,xmm4,xmm5
1101 vmulss xmm0,xmm9,xmm0
1105 vmulss xmm3,xmm6,xmm3
1109 vsubss xmm0,xmm0,xmm3
110d vmulss xmm1,xmm6,xmm1
1111 vmulss xmm2,xmm9,xmm2
1115 vsubss xmm1,xmm1,xmm2
1119 vaddss xmm2,xmm4,xmm0
111d vaddss xmm2,xmm1,xmm2
1121 vmovss xmm3,DWORD PTR [rip+0x2ed7]
1129 vmulss xmm5,xmm10,xmm0
112d vfmadd231ss xmm5,xmm4,xmm8
1132 vfmadd231ss xmm5,xmm1,xmm11
1137 vmulss xmm4,xmm5,DWORD PTR [rdi+0x14]
113c vdivss xmm2,xmm3,xmm2
1140 vmulss xmm3,xmm2,xmm4
1144 vmovss DWORD PTR [rdx],xmm3
1148 vmulss xmm0,xmm0,xmm2
114c vmovss DWORD PTR [rcx],xmm0
1150 vmulss xmm0,xmm1,xmm2
1154 vmovss DWORD PTR [r8],xmm0
1159 mov    rsp,rbp
115c pop    rbp
115d ret
115e xchg   ax,ax

0000000000001160 <wide8_end>:
1160 push   rbp
1161 mov    rbp,rsp
1164 push   r15
1166 push   r14
1168 push   rbx
1169 and    rsp,0xfffffffffffffff0
116d sub    rsp,0x40
1171 mov    ebx,DWORD PTR [rsi+0x68]
1174 mov    r14d,DWORD PTR [rsi+0x6c]
1178 shl    r14,0x5
117c add    r14,rdx
117f mov    eax,0xffffffff
1184 cmp    rbx,rax
1187 je     12c6 <wide8_end+0x166>
118d mov    r15,rdi
1190 vmovss xmm0,DWORD PTR [rsi+0x58]
1195 vmovss DWORD PTR [rsp+0x8],xmm0
119b mov    rax,rbx
119e shr    rax,0x3
11a2 imul   rax,rax,0x160
11a9 add    r15,rax
11ac and    ebx,0x7
11af lea    rax,[r15+rbx*4]
11b3 add    rsi,0x34
11b7 lea    rcx,[rsp+0x14]
11bc lea    rdx,[rsp+0x34]
11c1 lea    r8,[rsp+0xc]
11c6 mov    rdi,rsi
11c9 mov    rsi,rax
11cc call   1000 <shear_intersect>
11d1 vmovss xmm0,DWORD PTR [r15+rbx*4+0x60]
11d8 vmovss xmm1,DWORD PTR [r15+rbx*4]
11de vmovss xmm2,DWORD PTR [r15+rbx*4+0x20]
11e5 vsubss xmm0,xmm0,xmm1
11e9 vmovss xmm3,DWORD PTR [r15+rbx*4+0x80]
11f3 vsubss xmm3,xmm3,xmm2
11f7 vmovss xmm4,DWORD PTR [r15+rbx*4+0xa0]
1201 vmovss xmm5,DWORD PTR [r15+rbx*4+0x40]
1208 vsubss xmm4,xmm4,xmm5
120c vmovss xmm6,DWORD PTR [r15+rbx*4+0xc0]
1216 vsubss xmm1,xmm6,xmm1
121a vmovss xmm6,DWORD PTR [r15+rbx*4+0xe0]
1224 vsubss xmm2,xmm6,xmm2
1228 vmovss xmm6,DWORD PTR [r15+rbx*4+0x100]
1232 vmovss xmm7,DWORD PTR [rsp+0x8]
1238 vmovss DWORD PTR [rsp+0x10],xmm7
123e vsubss xmm5,xmm6,xmm5
1242 vmovss xmm6,DWORD PTR [rsp+0xc]
1248 vmovss DWORD PTR [rsp+0x18],xmm6
124e mov    eax,DWORD PTR [r15+rbx*4+0x120]
1256 mov    DWORD PTR [rsp+0x1c],eax
125a mov    eax,DWORD PTR [r15+rbx*4+0x140]
1262 mov    DWORD PTR [rsp+0x20],eax
1266 vmulss xmm6,xmm2,xmm4
126a vfmsub231ss xmm6,xmm3,xmm5
126f vmovss DWORD PTR [rsp+0x24],xmm6
1275 vmulss xmm5,xmm5,xmm0
1279 vfmsub231ss xmm5,xmm1,xmm4
127e vmovss DWORD PTR [rsp+0x28],xmm5
1284 vmulss xmm1,xmm1,xmm3
1288 vfmsub231ss xmm1,xmm0,xmm2
128d vmovss DWORD PTR [rsp+0x2c],xmm1
1293 mov    rax,QWORD PTR [rsp+0x10]
1298 mov    QWORD PTR [r14],rax
129b mov    eax,DWORD PTR [rsp+0x18]
129f mov    DWORD PTR [r14+0x8],eax
12a3 mov    eax,DWORD PTR [rsp+0x1c]
12a7 mov    DWORD PTR [r14+0xc],eax
12ab mov    eax,DWORD PTR [rsp+0x20]
12af mov    DWORD PTR [r14+0x10],eax
12b3 mov    rax,QWORD PTR [rsp+0x24]
12b8 mov    QWORD PTR [r14+0x14],rax
12bc mov    eax,DWORD PTR [rsp+0x2c]
12c0 mov    DWORD PTR [r14+0x1c],eax
12c4 jmp    12ea <wide8_end+0x18a>
12c6 vmovss xmm0,DWORD PTR [rsi+0x5c]
12cb vmovss DWORD PTR [r14],xmm0
12d0 mov    QWORD PTR [r14+0x4],0x0
12d8 mov    DWORD PTR [r14+0xc],0xffffffff
12e0 vxorps xmm0,xmm0,xmm0
12e4 vmovups XMMWORD PTR [r14+0x10],xmm0
12ea lea    rsp,[rbp-0x18]
12ee pop    rbx
12ef pop    r14
12f1 pop    r15
12f3 pop    rbp
12f4 ret
12f5 data16 cs nop WORD PTR [rax+rax*1+0x0]

0000000000001300 <wide8_step>:
1300 push   rbp
1301 mov    rbp,rsp
1304 push   r14
1306 push   rbx
1307 and    rsp,0xffffffffffffffe0
130b sub    rsp,0x20
130f mov    r8d,DWORD PTR [rdx+0x60]
1313 mov    r10d,DWORD PTR [rdx+0x64]
1317 test   r8d,r8d
131a js     14d0 <wide8_step+0x1d0>
1320 shl    r8,0x8
1324 lea    r9,[rdi+r8*1]
1328 mov    esi,DWORD PTR [rdx+0x28]
132b mov    eax,DWORD PTR [rdx+0x2c]
132e mov    rbx,rsi
1331 shl    rbx,0x5
1335 vmovaps ymm0,YMMWORD PTR [rbx+r9*1]
133b vbroadcastss ymm1,DWORD PTR [rdx]
1340 vsubps ymm0,ymm0,ymm1
1344 vbroadcastss ymm2,DWORD PTR [rdx+0x10]
134a vmulps ymm0,ymm0,ymm2
134e xor    rsi,0x1
1352 shl    rsi,0x5
1356 vmovaps ymm2,YMMWORD PTR [rsi+r9*1]
135c vsubps ymm1,ymm2,ymm1
1360 vbroadcastss ymm2,DWORD PTR [rdx+0x1c]
1366 vmulps ymm1,ymm1,ymm2
136a mov    rsi,rax
136d shl    rsi,0x5
1371 vmovaps ymm2,YMMWORD PTR [rsi+r9*1]
1377 vbroadcastss ymm3,DWORD PTR [rdx+0x4]
137d vsubps ymm2,ymm2,ymm3
1381 vbroadcastss ymm4,DWORD PTR [rdx+0x14]
1387 vmulps ymm2,ymm2,ymm4
138b vmaxps ymm0,ymm0,ymm2
138f xor    rax,0x1
1393 shl    rax,0x5
1397 vmovaps ymm2,YMMWORD PTR [rax+r9*1]
139d vsubps ymm2,ymm2,ymm3
13a1 vbroadcastss ymm3,DWORD PTR [rdx+0x20]
13a7 vmulps ymm2,ymm2,ymm3
13ab vminps ymm1,ymm1,ymm2
13af mov    eax,DWORD PTR [rdx+0x30]
13b2 mov    rsi,rax
13b5 shl    rsi,0x5
13b9 vmovaps ymm2,YMMWORD PTR [rsi+r9*1]
13bf vbroadcastss ymm3,DWORD PTR [rdx+0x8]
13c5 vsubps ymm2,ymm2,ymm3
13c9 vbroadcastss ymm4,DWORD PTR [rdx+0x18]
13cf vmulps ymm2,ymm2,ymm4
13d3 xor    rax,0x1
13d7 shl    rax,0x5
13db vmovaps ymm4,YMMWORD PTR [rax+r9*1]
13e1 vsubps ymm3,ymm4,ymm3
13e5 vbroadcastss ymm4,DWORD PTR [rdx+0x24]
13eb vmulps ymm3,ymm3,ymm4
13ef vbroadcastss ymm4,DWORD PTR [rdx+0xc]
13f5 vmaxps ymm2,ymm2,ymm4
13f9 vmaxps ymm0,ymm0,ymm2
13fd vbroadcastss ymm2,DWORD PTR [rdx+0x58]
1403 vminps ymm2,ymm3,ymm2
1407 vmovaps YMMWORD PTR [rsp],ymm0
140c vminps ymm1,ymm1,ymm2
1410 vcmpleps ymm0,ymm0,ymm1
1415 vmovmskps eax,ymm0
1419 test   eax,eax
141b je     16d0 <wide8_step+0x3d0>
1421 add    r8,rdi
1424 add    r8,0xc0
142b movzx  edi,al
142e xor    eax,eax
1430 tzcnt  eax,edi
1434 mov    esi,DWORD PTR [r8+rax*4]
1438 blsr   r9d,edi
143d je     1705 <wide8_step+0x405>
1443 mov    r14d,DWORD PTR [rsp+rax*4]
1447 shl    r14,0x20
144b or     r14,rsi
144e mov    r11d,r10d
1451 jmp    1472 <wide8_step+0x172>
1453 data16 data16 data16 cs nop WORD PTR [rax+rax*1+0x0]
1460 mov    edi,edi
1462 inc    r11d
1465 mov    QWORD PTR [rcx+rdi*8],rsi
1469 test   r9d,r9d
146c je     16fe <wide8_step+0x3fe>
1472 mov    rax,r14
1475 xor    esi,esi
1477 tzcnt  esi,r9d
147c blsr   r9d,r9d
1481 mov    edi,DWORD PTR [rsp+rsi*4]
1484 shl    rdi,0x20
1488 mov    r14d,DWORD PTR [r8+rsi*4]
148c or     r14,rdi
148f cmp    rax,r14
1492 mov    rsi,r14
1495 cmova  rsi,rax
1499 mov    edi,r11d
149c cmovb  r14,rax
14a0 cmp    r11d,r10d
14a3 jbe    1462 <wide8_step+0x162>
14a5 data16 cs nop WORD PTR [rax+rax*1+0x0]
14b0 lea    rbx,[rdi-0x1]
14b4 mov    eax,ebx
14b6 mov    rax,QWORD PTR [rcx+rax*8]
14ba cmp    rax,rsi
14bd jae    1460 <wide8_step+0x160>
14bf mov    QWORD PTR [rcx+rdi*8],rax
14c3 mov    rdi,rbx
14c6 cmp    r10d,ebx
14c9 jb     14b0 <wide8_step+0x1b0>
14cb mov    edi,r10d
14ce jmp    1460 <wide8_step+0x160>
14d0 mov    eax,r8d
14d3 and    eax,0x7fffffff
14d8 imul   rax,rax,0x160
14df add    rsi,rax
14e2 mov    eax,DWORD PTR [rdx+0x3c]
14e5 lea    edi,[rax+0x3]
14e8 lea    ebx,[rax+0x6]
14eb shl    rax,0x5
14ef vmovaps ymm1,YMMWORD PTR [rax+rsi*1]
14f4 shl    rdi,0x5
14f8 vmovaps ymm2,YMMWORD PTR [rdi+rsi*1]
14fd shl    rbx,0x5
1501 vmovaps ymm3,YMMWORD PTR [rbx+rsi*1]
1506 mov    eax,DWORD PTR [rdx+0x34]
1509 mov    r9d,DWORD PTR [rdx+0x38]
150d lea    r11d,[rax+0x3]
1511 lea    ebx,[rax+0x6]
1514 shl    rax,0x5
1518 vmovaps ymm4,YMMWORD PTR [rax+rsi*1]
151d lea    eax,[r9+0x3]
1521 lea    edi,[r9+0x6]
1525 shl    r9,0x5
1529 vmovaps ymm5,YMMWORD PTR [r9+rsi*1]
152f shl    r11,0x5
1533 vmovaps ymm6,YMMWORD PTR [r11+rsi*1]
1539 vbroadcastss ymm0,DWORD PTR [rdx+0x58]
153f vbroadcastss ymm7,DWORD PTR [rdx+0x54]
1545 vsubps ymm1,ymm1,ymm7
1549 vsubps ymm2,ymm2,ymm7
154d vsubps ymm3,ymm3,ymm7
1551 vbroadcastss ymm7,DWORD PTR [rdx+0x40]
1557 vbroadcastss ymm8,DWORD PTR [rdx+0x4c]
155d vsubps ymm4,ymm4,ymm8
1562 vmulps ymm9,ymm1,ymm7
1566 vsubps ymm4,ymm4,ymm9
156b vbroadcastss ymm9,DWORD PTR [rdx+0x44]
1571 vbroadcastss ymm10,DWORD PTR [rdx+0x50]
1577 vsubps ymm5,ymm5,ymm10
157c vmulps ymm11,ymm9,ymm1
1580 vsubps ymm5,ymm5,ymm11
1585 vsubps ymm6,ymm6,ymm8
158a vmulps ymm11,ymm2,ymm7
158e vsubps ymm6,ymm6,ymm11
1593 shl    rax,0x5
1597 vmovaps ymm11,YMMWORD PTR [rax+rsi*1]
159c vsubps ymm11,ymm11,ymm10
15a1 vmulps ymm12,ymm9,ymm2
15a5 vsubps ymm11,ymm11,ymm12
15aa shl    rbx,0x5
15ae vmovaps ymm12,YMMWORD PTR [rbx+rsi*1]
15b3 vsubps ymm8,ymm12,ymm8
15b8 vmulps ymm7,ymm3,ymm7
15bc vsubps ymm7,ymm8,ymm7
15c0 shl    rdi,0x5
15c4 vmovaps ymm8,YMMWORD PTR [rdi+rsi*1]
15c9 vsubps ymm8,ymm8,ymm10
15ce vmulps ymm9,ymm9,ymm3
15d2 vsubps ymm8,ymm8,ymm9
15d7 vmulps ymm9,ymm11,ymm7
15db vmulps ymm10,ymm8,ymm6
15df vsubps ymm9,ymm9,ymm10
15e4 vmulps ymm8,ymm8,ymm4
15e8 vmulps ymm7,ymm5,ymm7
15ec vsubps ymm7,ymm8,ymm7
15f0 vmulps ymm5,ymm6,ymm5
15f4 vmulps ymm4,ymm11,ymm4
15f8 vsubps ymm4,ymm5,ymm4
15fc vminps ymm5,ymm9,ymm7
1600 vminps ymm5,ymm5,ymm4
1604 vxorps xmm6,xmm6,xmm6
1608 vmaxps ymm8,ymm9,ymm7
160c vmaxps ymm8,ymm8,ymm4
1610 vaddps ymm10,ymm9,ymm7
1614 vaddps ymm10,ymm10,ymm4
1618 vmulps ymm2,ymm2,ymm7
161c vfmadd231ps ymm2,ymm9,ymm1
1621 vfmadd231ps ymm2,ymm4,ymm3
1626 vbroadcastss ymm1,DWORD PTR [rdx+0x48]
162c vmulps ymm1,ymm1,ymm2
1630 vbroadcastss ymm2,DWORD PTR [rip+0x29cb]
1639 vandps ymm2,ymm10,ymm2
163d vxorps ymm1,ymm2,ymm1
1641 vbroadcastss ymm2,DWORD PTR [rip+0x29be]
164a vandps ymm2,ymm10,ymm2
164e vbroadcastss ymm3,DWORD PTR [rdx+0xc]
1654 vmulps ymm3,ymm3,ymm2
1658 vmulps ymm4,ymm0,ymm2
165c vcmpleps ymm7,ymm8,ymm6
1661 vcmpleps ymm5,ymm6,ymm5
1666 vorps  ymm5,ymm5,ymm7
166a vcmpltps ymm3,ymm3,ymm1
166f vandps ymm3,ymm3,ymm5
1673 vcmpltps ymm4,ymm1,ymm4
1678 vandps ymm3,ymm3,ymm4
167c vmovmskps eax,ymm3
1680 test   eax,eax
1682 je     16d0 <wide8_step+0x3d0>
1684 vdivps ymm1,ymm1,ymm2
1688 movzx  eax,al
168b vmovaps YMMWORD PTR [rsp],ymm1
1690 shl    r8d,0x3
1694 jmp    16a7 <wide8_step+0x3a7>
1696 cs nop WORD PTR [rax+rax*1+0x0]
16a0 blsr   eax,eax
16a5 je     16d0 <wide8_step+0x3d0>
16a7 xor    esi,esi
16a9 tzcnt  esi,eax
16ad vmovss xmm1,DWORD PTR [rsp+rsi*4]
16b2 vucomiss xmm0,xmm1
16b6 jbe    16a0 <wide8_step+0x3a0>
16b8 vmovss DWORD PTR [rdx+0x58],xmm1
16bd add    esi,r8d
16c0 mov    DWORD PTR [rdx+0x68],esi
16c3 vmovaps xmm0,xmm1
16c7 jmp    16a0 <wide8_step+0x3a0>
16c9 nop    DWORD PTR [rax+0x0]
16d0 test   r10,r10
16d3 je     16fa <wide8_step+0x3fa>
16d5 dec    r10
16d8 mov    eax,r10d
16db mov    rax,QWORD PTR [rcx+rax*8]
16df mov    rsi,rax
16e2 shr    rsi,0x20
16e6 vmovd  xmm0,esi
16ea vucomiss xmm0,DWORD PTR [rdx+0x58]
16ef jae    16d0 <wide8_step+0x3d0>
16f1 mov    DWORD PTR [rdx+0x60],eax
16f4 mov    DWORD PTR [rdx+0x64],r10d
16f8 jmp    1708 <wide8_step+0x408>
16fa xor    eax,eax
16fc jmp    170d <wide8_step+0x40d>
16fe mov    DWORD PTR [rdx+0x64],r11d
1702 mov    esi,r14d
1705 mov    DWORD PTR [rdx+0x60],esi
1708 mov    eax,0x1
170d lea    rsp,[rbp-0x10]
1711 pop    rbx
1712 pop    r14
1714 pop    rbp
1715 vzeroupper
1718 ret
1719 nop    DWORD PTR [rax+0x0]

0000000000001720 <_pocl_kernel_closest>:
1720 push   rbp
1721 mov    rbp,rsp
1724 push   r15
1726 push   r14
1728 push   r13
172a push   r12
172c push   rbx
172d and    rsp,0xffffffffffffffc0
1731 sub    rsp,0xb540
1738 mov    QWORD PTR [rsp+0x50],rcx
173d mov    QWORD PTR [rsp+0x48],rdx
1742 mov    QWORD PTR [rsp+0x58],rsi
1747 mov    r14,rdi
174a shl    r9,0x3
174e mov    QWORD PTR [rsp+0xe0],r9
1756 vbroadcastss xmm0,DWORD PTR [rip+0x28a9]
175f vmovaps XMMWORD PTR [rsp+0xd0],xmm0
1768 vbroadcastss xmm0,DWORD PTR [rip+0x289b]
1771 vmovaps XMMWORD PTR [rsp+0xc0],xmm0
177a vbroadcastss xmm0,DWORD PTR [rip+0x2881]
1783 vmovaps XMMWORD PTR [rsp+0xb0],xmm0
178c vbroadcastss xmm0,DWORD PTR [rip+0x2877]
1795 vmovaps XMMWORD PTR [rsp+0xa0],xmm0
179e vbroadcastss xmm0,DWORD PTR [rip+0x2859]
17a7 vmovaps XMMWORD PTR [rsp+0x90],xmm0
17b0 vbroadcastss xmm0,DWORD PTR [rip+0x2857]
17b9 vmovaps XMMWORD PTR [rsp+0x80],xmm0
17c2 vpbroadcastq xmm0,QWORD PTR [rip+0x284d]
17cb vmovdqa XMMWORD PTR [rsp+0xf0],xmm0
17d4 xor    r11d,r11d
17d7 mov    QWORD PTR [rsp+0x40],rdi
17dc nop    DWORD PTR [rax+0x0]
17e0 mov    rax,QWORD PTR [rsp+0xe0]
17e8 lea    r8d,[r11+rax*1]
17ec shl    r8d,0x4
17f0 mov    rax,r8
17f3 shl    rax,0x5
17f7 mov    r10,QWORD PTR [rsp+0x48]
17fc vmovss xmm0,DWORD PTR [r10+rax*1+0x18]
1803 vmovaps xmm7,XMMWORD PTR [rsp+0xd0]
180c vandps xmm2,xmm0,xmm7
1810 vmovaps xmm1,XMMWORD PTR [r10+rax*1+0x10]
1817 vandps xmm4,xmm1,xmm7
181b vpermilps xmm3,xmm4,0xf5
1821 vucomiss xmm2,xmm3
1825 mov    ecx,0x1
182a sbb    ecx,0xffffffff
182d xor    esi,esi
182f vucomiss xmm4,xmm3
1833 setb   sil
1837 vucomiss xmm2,xmm4
183b cmovae esi,ecx
183e lea    ecx,[rsi+0x1]
1841 vucomiss xmm2,xmm3
1845 mov    edi,ecx
1847 mov    r14d,0x0
184d cmovae edi,r14d
1851 vucomiss xmm2,xmm4
1855 vmovmskps edx,xmm0
1859 cmovb  edi,ecx
185c shl    edx,0x1f
185f or     edx,0x1e3ce508
1865 vmovd  xmm3,edx
1869 vmovss xmm8,DWORD PTR [rip+0x279b]
1871 vcmpltss xmm2,xmm8,xmm2
1876 vblendvps xmm2,xmm3,xmm0,xmm2
187c vmovaps xmm3,XMMWORD PTR [r10+rax*1]
1882 vmovss xmm9,DWORD PTR [rip+0x2776]
188a vdivss xmm5,xmm9,xmm2
188e imul   rcx,r11,0x70
1892 vpbroadcastd xmm2,DWORD PTR [r10+rax*1+0x1c]
1899 vmovaps XMMWORD PTR [rsp+rcx*1+0x200],xmm3
18a2 vmovaps xmm10,XMMWORD PTR [rsp+0xc0]
18ab vcmpltps xmm4,xmm10,xmm4
18b0 vmovaps xmm11,XMMWORD PTR [rsp+0xb0]
18b9 vandps xmm6,xmm11,xmm1
18bd vmovaps xmm12,XMMWORD PTR [rsp+0xa0]
18c6 vorps  xmm6,xmm12,xmm6
18ca vblendvps xmm4,xmm6,xmm1,xmm4
18d0 vmovaps xmm13,XMMWORD PTR [rsp+0x90]
18d9 vdivps xmm4,xmm13,xmm4
18dd vmovlps QWORD PTR [rsp+rcx*1+0x210],xmm4
18e6 vmovss DWORD PTR [rsp+rcx*1+0x218],xmm5
18ef vmovaps xmm14,XMMWORD PTR [rsp+0x80]
18f8 vmulps xmm6,xmm14,xmm4
18fc vmovlps QWORD PTR [rsp+rcx*1+0x21c],xmm6
1905 vmovss xmm15,DWORD PTR [rip+0x2703]
190d vmulss xmm6,xmm15,xmm5
1911 vmovss DWORD PTR [rsp+rcx*1+0x224],xmm6
191a xor    eax,eax
191c vxorps xmm6,xmm6,xmm6
1920 vucomiss xmm6,xmm4
1924 seta   al
1927 mov    DWORD PTR [rsp+rcx*1+0x228],eax
192e vmovshdup xmm4,xmm4
1932 vinsertps xmm4,xmm4,xmm5,0x10
1938 vxorps xmm5,xmm5,xmm5
193c vcmpltps xmm4,xmm4,xmm5
1941 vmovdqa xmm8,XMMWORD PTR [rsp+0xf0]
194a vpsubd xmm4,xmm8,xmm4
194e vmovq  QWORD PTR [rsp+rcx*1+0x22c],xmm4
1957 mov    DWORD PTR [rsp+rcx*1+0x23c],esi
195e mov    DWORD PTR [rsp+rcx*1+0x234],edi
1965 lea    eax,[rdi+0x1]
1968 cmp    edi,0x2
196b cmove  eax,r14d
196f mov    DWORD PTR [rsp+rcx*1+0x238],eax
1976 mov    r9,r11
1979 shl    r9,0x4
197d vmovlps QWORD PTR [rsp+r9*1+0x100],xmm1
1987 vmovlps QWORD PTR [rsp+r9*1+0x180],xmm3
1991 lea    r15,[rsp+r9*1]
1995 add    r15,0x100
199c vextractps DWORD PTR [rsp+r9*1+0x188],xmm3,0x2
19a7 vmovss DWORD PTR [rsp+r9*1+0x108],xmm0
19b1 shl    rsi,0x2
19b5 mov    rdx,r15
19b8 or     rdx,rsi
19bb vdivss xmm0,xmm9,DWORD PTR [rdx]
19bf vmovss DWORD PTR [rsp+rcx*1+0x248],xmm0
19c8 vmulss xmm1,xmm0,DWORD PTR [r15+rdi*4]
19ce vmovss DWORD PTR [rsp+rcx*1+0x240],xmm1
19d7 vmulss xmm0,xmm0,DWORD PTR [r15+rax*4]
19dd vmovss DWORD PTR [rsp+rcx*1+0x244],xmm0
19e6 lea    rbx,[rsp+r9*1+0x180]
19ee vmovss xmm0,DWORD PTR [rbx+rdi*4]
19f3 vmovss DWORD PTR [rsp+rcx*1+0x24c],xmm0
19fc vmovss xmm0,DWORD PTR [rbx+rax*4]
1a01 vmovss DWORD PTR [rsp+rcx*1+0x250],xmm0
1a0a or     rsi,rbx
1a0d vmovss xmm0,DWORD PTR [rsi]
1a11 vmovss DWORD PTR [rsp+rcx*1+0x254],xmm0
1a1a vmovq  rax,xmm2
1a1f vmovq  xmm0,rax
1a24 vmovdqu XMMWORD PTR [rsp+rcx*1+0x258],xmm0
1a2d lea    r13d,[r8+0x1]
1a31 mov    DWORD PTR [rsp+rcx*1+0x268],0xffffffff
1a3c mov    DWORD PTR [rsp+rcx*1+0x26c],r8d
1a44 mov    rax,r13
1a47 shl    rax,0x5
1a4b vmovss xmm0,DWORD PTR [r10+rax*1+0x18]
1a52 vandps xmm3,xmm0,xmm7
1a56 vmovaps xmm1,XMMWORD PTR [r10+rax*1]
1a5c vmovaps xmm2,XMMWORD PTR [r10+rax*1+0x10]
1a63 vandps xmm4,xmm2,xmm7
1a67 vpermilps xmm5,xmm4,0xf5
1a6d vucomiss xmm3,xmm5
1a71 mov    edx,0x1
1a76 sbb    edx,0xffffffff
1a79 xor    esi,esi
1a7b vucomiss xmm4,xmm5
1a7f setb   sil
1a83 vucomiss xmm3,xmm4
1a87 cmovae esi,edx
1a8a lea    edx,[rsi+0x1]
1a8d vucomiss xmm3,xmm5
1a91 mov    edi,edx
1a93 cmovae edi,r14d
1a97 vucomiss xmm3,xmm4
1a9b cmovb  edi,edx
1a9e vmovmskps edx,xmm0
1aa2 shl    edx,0x1f
1aa5 or     edx,0x1e3ce508
1aab vmovd  xmm5,edx
1aaf vmovss xmm6,DWORD PTR [rip+0x2555]
1ab7 vcmpltss xmm3,xmm6,xmm3
1abc vblendvps xmm3,xmm5,xmm0,xmm3
1ac2 vdivss xmm5,xmm9,xmm3
1ac6 vpbroadcastd xmm3,DWORD PTR [r10+rax*1+0x1c]
1acd vmovaps XMMWORD PTR [rsp+rcx*1+0x580],xmm1
1ad6 vcmpltps xmm4,xmm10,xmm4
1adb vandps xmm6,xmm11,xmm2
1adf vorps  xmm6,xmm12,xmm6
1ae3 vblendvps xmm4,xmm6,xmm2,xmm4
1ae9 vdivps xmm4,xmm13,xmm4
1aed vmovlps QWORD PTR [rsp+rcx*1+0x590],xmm4
1af6 vmovss DWORD PTR [rsp+rcx*1+0x598],xmm5
1aff vmulps xmm6,xmm14,xmm4
1b03 vmovlps QWORD PTR [rsp+rcx*1+0x59c],xmm6
1b0c vmulss xmm6,xmm15,xmm5
1b10 vmovss DWORD PTR [rsp+rcx*1+0x5a4],xmm6
1b19 lea    eax,[r8+0x10]
1b1d mov    DWORD PTR [rsp+0x3c],eax
1b21 or     r8d,0x2
1b25 xor    eax,eax
1b27 vxorps xmm6,xmm6,xmm6
1b2b vucomiss xmm6,xmm4
1b2f seta   al
1b32 vmovshdup xmm4,xmm4
1b36 vinsertps xmm4,xmm4,xmm5,0x10
1b3c mov    DWORD PTR [rsp+rcx*1+0x5a8],eax
1b43 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x24e4]
1b4c vpsubd xmm4,xmm8,xmm4
1b50 vmovq  QWORD PTR [rsp+rcx*1+0x5ac],xmm4
1b59 vmovlps QWORD PTR [rsp+r9*1+0x100],xmm2
1b63 lea    eax,[rdi+0x1]
1b66 cmp    edi,0x2
1b69 cmove  eax,r14d
1b6d vmovss DWORD PTR [rsp+r9*1+0x108],xmm0
1b77 vmovlps QWORD PTR [rsp+r9*1+0x180],xmm1
1b81 mov    DWORD PTR [rsp+rcx*1+0x5bc],esi
1b88 vextractps DWORD PTR [rsp+r9*1+0x188],xmm1,0x2
1b93 shl    rsi,0x2
1b97 mov    rdx,r15
1b9a or     rdx,rsi
1b9d vdivss xmm0,xmm9,DWORD PTR [rdx]
1ba1 mov    DWORD PTR [rsp+rcx*1+0x5b4],edi
1ba8 mov    DWORD PTR [rsp+rcx*1+0x5b8],eax
1baf vmovss DWORD PTR [rsp+rcx*1+0x5c8],xmm0
1bb8 vmulss xmm1,xmm0,DWORD PTR [r15+rdi*4]
1bbe vmovss DWORD PTR [rsp+rcx*1+0x5c0],xmm1
1bc7 mov    QWORD PTR [rsp+0x68],r15
1bcc vmulss xmm0,xmm0,DWORD PTR [r15+rax*4]
1bd2 vmovss DWORD PTR [rsp+rcx*1+0x5c4],xmm0
1bdb vmovss xmm0,DWORD PTR [rbx+rdi*4]
1be0 vmovss DWORD PTR [rsp+rcx*1+0x5cc],xmm0
1be9 vmovss xmm0,DWORD PTR [rbx+rax*4]
1bee vmovss DWORD PTR [rsp+rcx*1+0x5d0],xmm0
1bf7 mov    QWORD PTR [rsp+0x60],rbx
1bfc or     rsi,rbx
1bff vmovss xmm0,DWORD PTR [rsi]
1c03 vmovss DWORD PTR [rsp+rcx*1+0x5d4],xmm0
1c0c vmovq  rax,xmm3
1c11 vmovq  xmm0,rax
1c16 vmovdqu XMMWORD PTR [rsp+rcx*1+0x5d8],xmm0
1c1f lea    r14,[rsp+rcx*1+0x200]
1c27 lea    r15,[rsp+rcx*1]
1c2b add    r15,0x580
1c32 mov    DWORD PTR [rsp+rcx*1+0x5e8],0xffffffff
1c3d mov    QWORD PTR [rsp+0xe8],r11
1c45 imul   rax,r11,0xac0
1c4c lea    rcx,[rsp+rax*1]
1c50 add    rcx,0x900
1c57 mov    QWORD PTR [rsp+0x78],rcx
1c5c add    rax,rsp
1c5f add    rax,0x5f00
1c65 mov    QWORD PTR [rsp+0x70],rax
1c6a mov    DWORD PTR [r15+0x6c],r13d
1c6e mov    r13d,r8d
1c71 mov    rbx,QWORD PTR [rsp+0x40]
1c76 mov    r12,QWORD PTR [rsp+0x58]
1c7b jmp    1e78 <_pocl_kernel_closest+0x758>
1c80 mov    edx,r13d
1c83 shl    rdx,0x5
1c87 mov    rdi,QWORD PTR [rsp+0x48]
1c8c vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
1c92 vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
1c9b vandps xmm3,xmm0,xmm4
1c9f vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
1ca4 vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
1caa vandps xmm4,xmm2,xmm4
1cae vpermilps xmm5,xmm4,0xf5
1cb4 vucomiss xmm3,xmm5
1cb8 mov    ecx,0x1
1cbd sbb    ecx,0xffffffff
1cc0 xor    eax,eax
1cc2 vucomiss xmm4,xmm5
1cc6 setb   al
1cc9 vucomiss xmm3,xmm4
1ccd cmovae eax,ecx
1cd0 lea    esi,[rax+0x1]
1cd3 vucomiss xmm3,xmm5
1cd7 mov    ecx,esi
1cd9 mov    ebx,0x0
1cde cmovae ecx,ebx
1ce1 vucomiss xmm3,xmm4
1ce5 cmovb  ecx,esi
1ce8 vmovmskps esi,xmm0
1cec shl    esi,0x1f
1cef or     esi,0x1e3ce508
1cf5 vmovd  xmm5,esi
1cf9 vmovss xmm6,DWORD PTR [rip+0x230b]
1d01 vcmpltss xmm3,xmm6,xmm3
1d06 vblendvps xmm3,xmm5,xmm0,xmm3
1d0c vmovss xmm7,DWORD PTR [rip+0x22ec]
1d14 vdivss xmm5,xmm7,xmm3
1d18 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
1d1f vmovaps XMMWORD PTR [r14],xmm1
1d24 vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
1d2d vcmpltps xmm4,xmm6,xmm4
1d32 vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
1d3b vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
1d44 vblendvps xmm4,xmm6,xmm2,xmm4
1d4a vmovaps xmm6,XMMWORD PTR [rsp+0x90]
1d53 vdivps xmm4,xmm6,xmm4
1d57 vmovlps QWORD PTR [r14+0x10],xmm4
1d5d vmovss DWORD PTR [r14+0x18],xmm5
1d63 vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
1d6c vmovlps QWORD PTR [r14+0x1c],xmm6
1d72 vmulss xmm6,xmm5,DWORD PTR [rip+0x2296]
1d7a vmovss DWORD PTR [r14+0x24],xmm6
1d80 xor    edx,edx
1d82 vxorps xmm6,xmm6,xmm6
1d86 vucomiss xmm6,xmm4
1d8a seta   dl
1d8d vmovshdup xmm4,xmm4
1d91 vinsertps xmm4,xmm4,xmm5,0x10
1d97 mov    DWORD PTR [r14+0x28],edx
1d9b vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x228c]
1da4 vmovdqa xmm5,XMMWORD PTR [rip+0x2274]
1dac vpsubd xmm4,xmm5,xmm4
1db0 vmovq  QWORD PTR [r14+0x2c],xmm4
1db6 mov    rdi,QWORD PTR [rsp+0x68]
1dbb vmovlps QWORD PTR [rdi],xmm2
1dbf mov    DWORD PTR [r14+0x3c],eax
1dc3 mov    DWORD PTR [r14+0x34],ecx
1dc7 lea    edx,[rcx+0x1]
1dca cmp    ecx,0x2
1dcd cmove  edx,ebx
1dd0 mov    rbx,QWORD PTR [rsp+0x60]
1dd5 vmovlps QWORD PTR [rbx],xmm1
1dd9 mov    DWORD PTR [r14+0x38],edx
1ddd vextractps DWORD PTR [rbx+0x8],xmm1,0x2
1de4 vmovss DWORD PTR [rdi+0x8],xmm0
1de9 shl    rax,0x2
1ded mov    rsi,rdi
1df0 or     rsi,rax
1df3 vdivss xmm0,xmm7,DWORD PTR [rsi]
1df7 vmovss DWORD PTR [r14+0x48],xmm0
1dfd vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
1e02 vmovss DWORD PTR [r14+0x40],xmm1
1e08 vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
1e0d vmovss DWORD PTR [r14+0x44],xmm0
1e13 vmovss xmm0,DWORD PTR [rbx+rcx*4]
1e18 vmovss DWORD PTR [r14+0x4c],xmm0
1e1e vmovss xmm0,DWORD PTR [rbx+rdx*4]
1e23 vmovss DWORD PTR [r14+0x50],xmm0
1e29 or     rax,rbx
1e2c vmovd  xmm0,DWORD PTR [rax]
1e30 vmovd  DWORD PTR [r14+0x54],xmm0
1e36 vmovq  QWORD PTR [r14+0x58],xmm3
1e3c mov    QWORD PTR [r14+0x60],0x0
1e44 mov    DWORD PTR [r14+0x68],0xffffffff
1e4c mov    DWORD PTR [r14+0x6c],r13d
1e50 lea    eax,[r13+0x1]
1e54 mov    r13d,eax
1e57 mov    rbx,QWORD PTR [rsp+0x40]
1e5c mov    rdi,rbx
1e5f mov    r12,QWORD PTR [rsp+0x58]
1e64 mov    rsi,r12
1e67 mov    rdx,r15
1e6a mov    rcx,QWORD PTR [rsp+0x70]
1e6f call   1300 <wide8_step>
1e74 test   eax,eax
1e76 je     1eb0 <_pocl_kernel_closest+0x790>
1e78 mov    rdi,rbx
1e7b mov    rsi,r12
1e7e mov    rdx,r14
1e81 mov    rcx,QWORD PTR [rsp+0x78]
1e86 call   1300 <wide8_step>
1e8b test   eax,eax
1e8d jne    1e57 <_pocl_kernel_closest+0x737>
1e8f mov    rdi,r12
1e92 mov    rsi,r14
1e95 mov    rdx,QWORD PTR [rsp+0x50]
1e9a call   1160 <wide8_end>
1e9f cmp    r13d,DWORD PTR [rsp+0x3c]
1ea4 jb     1c80 <_pocl_kernel_closest+0x560>
1eaa jmp    20c0 <_pocl_kernel_closest+0x9a0>
1eaf nop
1eb0 mov    rdi,r12
1eb3 mov    rsi,r15
1eb6 mov    rdx,QWORD PTR [rsp+0x50]
1ebb call   1160 <wide8_end>
1ec0 cmp    r13d,DWORD PTR [rsp+0x3c]
1ec5 jae    20a0 <_pocl_kernel_closest+0x980>
1ecb mov    edx,r13d
1ece shl    rdx,0x5
1ed2 mov    rdi,QWORD PTR [rsp+0x48]
1ed7 vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
1edd vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
1ee6 vandps xmm3,xmm0,xmm4
1eea vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
1eef vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
1ef5 vandps xmm4,xmm2,xmm4
1ef9 vpermilps xmm5,xmm4,0xf5
1eff vucomiss xmm3,xmm5
1f03 mov    ecx,0x1
1f08 sbb    ecx,0xffffffff
1f0b xor    eax,eax
1f0d vucomiss xmm4,xmm5
1f11 setb   al
1f14 vucomiss xmm3,xmm4
1f18 cmovae eax,ecx
1f1b lea    esi,[rax+0x1]
1f1e vucomiss xmm3,xmm5
1f22 mov    ecx,esi
1f24 mov    ebx,0x0
1f29 cmovae ecx,ebx
1f2c vucomiss xmm3,xmm4
1f30 cmovb  ecx,esi
1f33 vmovmskps esi,xmm0
1f37 shl    esi,0x1f
1f3a or     esi,0x1e3ce508
1f40 vmovd  xmm5,esi
1f44 vmovss xmm6,DWORD PTR [rip+0x20c0]
1f4c vcmpltss xmm3,xmm6,xmm3
1f51 vblendvps xmm3,xmm5,xmm0,xmm3
1f57 vmovss xmm7,DWORD PTR [rip+0x20a1]
1f5f vdivss xmm5,xmm7,xmm3
1f63 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
1f6a vmovaps XMMWORD PTR [r15],xmm1
1f6f vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
1f78 vcmpltps xmm4,xmm6,xmm4
1f7d vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
1f86 vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
1f8f vblendvps xmm4,xmm6,xmm2,xmm4
1f95 vmovaps xmm6,XMMWORD PTR [rsp+0x90]
1f9e vdivps xmm4,xmm6,xmm4
1fa2 vmovlps QWORD PTR [r15+0x10],xmm4
1fa8 vmovss DWORD PTR [r15+0x18],xmm5
1fae vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
1fb7 vmovlps QWORD PTR [r15+0x1c],xmm6
1fbd vmulss xmm6,xmm5,DWORD PTR [rip+0x204b]
1fc5 vmovss DWORD PTR [r15+0x24],xmm6
1fcb xor    edx,edx
1fcd vxorps xmm6,xmm6,xmm6
1fd1 vucomiss xmm6,xmm4
1fd5 seta   dl
1fd8 vmovshdup xmm4,xmm4
1fdc vinsertps xmm4,xmm4,xmm5,0x10
1fe2 mov    DWORD PTR [r15+0x28],edx
1fe6 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x2041]
1fef vmovdqa xmm5,XMMWORD PTR [rip+0x2029]
1ff7 vpsubd xmm4,xmm5,xmm4
1ffb vmovq  QWORD PTR [r15+0x2c],xmm4
2001 mov    rdi,QWORD PTR [rsp+0x68]
2006 vmovlps QWORD PTR [rdi],xmm2
200a mov    DWORD PTR [r15+0x3c],eax
200e mov    DWORD PTR [r15+0x34],ecx
2012 lea    edx,[rcx+0x1]
2015 cmp    ecx,0x2
2018 cmove  edx,ebx
201b mov    rbx,QWORD PTR [rsp+0x60]
2020 vmovlps QWORD PTR [rbx],xmm1
2024 mov    DWORD PTR [r15+0x38],edx
2028 vextractps DWORD PTR [rbx+0x8],xmm1,0x2
202f vmovss DWORD PTR [rdi+0x8],xmm0
2034 shl    rax,0x2
2038 mov    rsi,rdi
203b or     rsi,rax
203e vdivss xmm0,xmm7,DWORD PTR [rsi]
2042 vmovss DWORD PTR [r15+0x48],xmm0
2048 vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
204d vmovss DWORD PTR [r15+0x40],xmm1
2053 vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
2058 vmovss DWORD PTR [r15+0x44],xmm0
205e vmovss xmm0,DWORD PTR [rbx+rcx*4]
2063 vmovss DWORD PTR [r15+0x4c],xmm0
2069 vmovss xmm0,DWORD PTR [rbx+rdx*4]
206e vmovss DWORD PTR [r15+0x50],xmm0
2074 or     rax,rbx
2077 vmovd  xmm0,DWORD PTR [rax]
207b vmovd  DWORD PTR [r15+0x54],xmm0
2081 vmovq  QWORD PTR [r15+0x58],xmm3
2087 lea    r8d,[r13+0x1]
208b mov    QWORD PTR [r15+0x60],0x0
2093 mov    DWORD PTR [r15+0x68],0xffffffff
209b jmp    1c6a <_pocl_kernel_closest+0x54a>
20a0 mov    rdi,QWORD PTR [rsp+0x40]
20a5 mov    rsi,r12
20a8 mov    rdx,r14
20ab mov    rcx,QWORD PTR [rsp+0x78]
20b0 call   1300 <wide8_step>
20b5 test   eax,eax
20b7 jne    20a0 <_pocl_kernel_closest+0x980>
20b9 mov    r15,r14
20bc jmp    20e5 <_pocl_kernel_closest+0x9c5>
20be xchg   ax,ax
20c0 mov    r14,QWORD PTR [rsp+0x40]
20c5 mov    rbx,QWORD PTR [rsp+0x70]
20ca nop    WORD PTR [rax+rax*1+0x0]
20d0 mov    rdi,r14
20d3 mov    rsi,r12
20d6 mov    rdx,r15
20d9 mov    rcx,rbx
20dc call   1300 <wide8_step>
20e1 test   eax,eax
20e3 jne    20d0 <_pocl_kernel_closest+0x9b0>
20e5 mov    rdi,QWORD PTR [rsp+0x58]
20ea mov    rsi,r15
20ed mov    rdx,QWORD PTR [rsp+0x50]
20f2 call   1160 <wide8_end>
20f7 mov    r11,QWORD PTR [rsp+0xe8]
20ff inc    r11
2102 cmp    r11,0x8
2106 jne    17e0 <_pocl_kernel_closest+0xc0>
210c lea    rsp,[rbp-0x28]
2110 pop    rbx
2111 pop    r12
2113 pop    r13
2115 pop    r14
2117 pop    r15
2119 pop    rbp
211a ret
211b nop    DWORD PTR [rax+rax*1+0x0]

0000000000002120 <_pocl_kernel_closest_workgroup>:
2120 push   rbp
2121 mov    rbp,rsp
2124 push   r15
2126 push   r14
2128 push   r13
212a push   r12
212c push   rbx
212d and    rsp,0xffffffffffffffc0
2131 sub    rsp,0xb540
2138 mov    rax,QWORD PTR [rdi]
213b mov    rcx,QWORD PTR [rdi+0x8]
213f mov    r14,QWORD PTR [rax]
2142 mov    r12,QWORD PTR [rcx]
2145 mov    rax,QWORD PTR [rdi+0x10]
2149 mov    rax,QWORD PTR [rax]
214c mov    QWORD PTR [rsp+0x48],rax
2151 mov    rax,QWORD PTR [rdi+0x18]
2155 mov    rax,QWORD PTR [rax]
2158 mov    QWORD PTR [rsp+0x50],rax
215d shl    rdx,0x3
2161 mov    QWORD PTR [rsp+0xe0],rdx
2169 vbroadcastss xmm0,DWORD PTR [rip+0x1e96]
2172 vmovaps XMMWORD PTR [rsp+0xd0],xmm0
217b vbroadcastss xmm0,DWORD PTR [rip+0x1e88]
2184 vmovaps XMMWORD PTR [rsp+0xc0],xmm0
218d vbroadcastss xmm0,DWORD PTR [rip+0x1e6e]
2196 vmovaps XMMWORD PTR [rsp+0xb0],xmm0
219f vbroadcastss xmm0,DWORD PTR [rip+0x1e64]
21a8 vmovaps XMMWORD PTR [rsp+0xa0],xmm0
21b1 vbroadcastss xmm0,DWORD PTR [rip+0x1e46]
21ba vmovaps XMMWORD PTR [rsp+0x90],xmm0
21c3 vbroadcastss xmm0,DWORD PTR [rip+0x1e44]
21cc vmovaps XMMWORD PTR [rsp+0x80],xmm0
21d5 vpbroadcastq xmm0,QWORD PTR [rip+0x1e3a]
21de vmovdqa XMMWORD PTR [rsp+0xf0],xmm0
21e7 xor    r11d,r11d
21ea mov    QWORD PTR [rsp+0x40],r14
21ef mov    QWORD PTR [rsp+0x70],r12
21f4 data16 data16 cs nop WORD PTR [rax+rax*1+0x0]
2200 mov    rax,QWORD PTR [rsp+0xe0]
2208 lea    r8d,[r11+rax*1]
220c shl    r8d,0x4
2210 mov    rdx,r8
2213 shl    rdx,0x5
2217 mov    r9,QWORD PTR [rsp+0x48]
221c vmovss xmm0,DWORD PTR [r9+rdx*1+0x18]
2223 vmovaps xmm7,XMMWORD PTR [rsp+0xd0]
222c vandps xmm2,xmm0,xmm7
2230 vmovaps xmm1,XMMWORD PTR [r9+rdx*1+0x10]
2237 vandps xmm4,xmm1,xmm7
223b vpermilps xmm3,xmm4,0xf5
2241 vucomiss xmm2,xmm3
2245 mov    ecx,0x1
224a sbb    ecx,0xffffffff
224d xor    esi,esi
224f vucomiss xmm4,xmm3
2253 setb   sil
2257 vucomiss xmm2,xmm4
225b cmovae esi,ecx
225e lea    ecx,[rsi+0x1]
2261 vucomiss xmm2,xmm3
2265 mov    edi,ecx
2267 mov    r10d,0x0
226d cmovae edi,r10d
2271 vucomiss xmm2,xmm4
2275 vmovmskps ebx,xmm0
2279 cmovb  edi,ecx
227c shl    ebx,0x1f
227f or     ebx,0x1e3ce508
2285 vmovd  xmm3,ebx
2289 vmovss xmm8,DWORD PTR [rip+0x1d7b]
2291 vcmpltss xmm2,xmm8,xmm2
2296 vblendvps xmm2,xmm3,xmm0,xmm2
229c vmovaps xmm3,XMMWORD PTR [r9+rdx*1]
22a2 vmovss xmm9,DWORD PTR [rip+0x1d56]
22aa vdivss xmm5,xmm9,xmm2
22ae imul   rcx,r11,0x70
22b2 vpbroadcastd xmm2,DWORD PTR [r9+rdx*1+0x1c]
22b9 vmovaps XMMWORD PTR [rsp+rcx*1+0x200],xmm3
22c2 vmovaps xmm10,XMMWORD PTR [rsp+0xc0]
22cb vcmpltps xmm4,xmm10,xmm4
22d0 vmovaps xmm11,XMMWORD PTR [rsp+0xb0]
22d9 vandps xmm6,xmm11,xmm1
22dd vmovaps xmm12,XMMWORD PTR [rsp+0xa0]
22e6 vorps  xmm6,xmm12,xmm6
22ea vblendvps xmm4,xmm6,xmm1,xmm4
22f0 vmovaps xmm13,XMMWORD PTR [rsp+0x90]
22f9 vdivps xmm4,xmm13,xmm4
22fd vmovlps QWORD PTR [rsp+rcx*1+0x210],xmm4
2306 vmovss DWORD PTR [rsp+rcx*1+0x218],xmm5
230f vmovaps xmm14,XMMWORD PTR [rsp+0x80]
2318 vmulps xmm6,xmm14,xmm4
231c vmovlps QWORD PTR [rsp+rcx*1+0x21c],xmm6
2325 vmovss xmm15,DWORD PTR [rip+0x1ce3]
232d vmulss xmm6,xmm15,xmm5
2331 vmovss DWORD PTR [rsp+rcx*1+0x224],xmm6
233a xor    edx,edx
233c vxorps xmm6,xmm6,xmm6
2340 vucomiss xmm6,xmm4
2344 seta   dl
2347 mov    DWORD PTR [rsp+rcx*1+0x228],edx
234e vmovshdup xmm4,xmm4
2352 vinsertps xmm4,xmm4,xmm5,0x10
2358 vxorps xmm5,xmm5,xmm5
235c vcmpltps xmm4,xmm4,xmm5
2361 vmovdqa xmm8,XMMWORD PTR [rsp+0xf0]
236a vpsubd xmm4,xmm8,xmm4
236e vmovq  QWORD PTR [rsp+rcx*1+0x22c],xmm4
2377 mov    DWORD PTR [rsp+rcx*1+0x23c],esi
237e mov    DWORD PTR [rsp+rcx*1+0x234],edi
2385 lea    ebx,[rdi+0x1]
2388 cmp    edi,0x2
238b cmove  ebx,r10d
238f mov    DWORD PTR [rsp+rcx*1+0x238],ebx
2396 mov    rdx,r11
2399 shl    rdx,0x4
239d vmovlps QWORD PTR [rsp+rdx*1+0x100],xmm1
23a6 vmovlps QWORD PTR [rsp+rdx*1+0x180],xmm3
23af lea    r14,[rsp+rdx*1]
23b3 add    r14,0x100
23ba vextractps DWORD PTR [rsp+rdx*1+0x188],xmm3,0x2
23c5 vmovss DWORD PTR [rsp+rdx*1+0x108],xmm0
23ce shl    rsi,0x2
23d2 mov    rax,r14
23d5 or     rax,rsi
23d8 vdivss xmm0,xmm9,DWORD PTR [rax]
23dc vmovss DWORD PTR [rsp+rcx*1+0x248],xmm0
23e5 vmulss xmm1,xmm0,DWORD PTR [r14+rdi*4]
23eb vmovss DWORD PTR [rsp+rcx*1+0x240],xmm1
23f4 vmulss xmm0,xmm0,DWORD PTR [r14+rbx*4]
23fa vmovss DWORD PTR [rsp+rcx*1+0x244],xmm0
2403 lea    r12,[rsp+rdx*1+0x180]
240b vmovss xmm0,DWORD PTR [r12+rdi*4]
2411 vmovss DWORD PTR [rsp+rcx*1+0x24c],xmm0
241a vmovss xmm0,DWORD PTR [r12+rbx*4]
2420 vmovss DWORD PTR [rsp+rcx*1+0x250],xmm0
2429 or     rsi,r12
242c vmovss xmm0,DWORD PTR [rsi]
2430 vmovss DWORD PTR [rsp+rcx*1+0x254],xmm0
2439 vmovq  rax,xmm2
243e vmovq  xmm0,rax
2443 vmovdqu XMMWORD PTR [rsp+rcx*1+0x258],xmm0
244c lea    r15d,[r8+0x1]
2450 mov    DWORD PTR [rsp+rcx*1+0x268],0xffffffff
245b mov    DWORD PTR [rsp+rcx*1+0x26c],r8d
2463 mov    rbx,r15
2466 shl    rbx,0x5
246a vmovss xmm0,DWORD PTR [r9+rbx*1+0x18]
2471 vandps xmm3,xmm0,xmm7
2475 vmovaps xmm1,XMMWORD PTR [r9+rbx*1]
247b vmovaps xmm2,XMMWORD PTR [r9+rbx*1+0x10]
2482 vandps xmm4,xmm2,xmm7
2486 vpermilps xmm5,xmm4,0xf5
248c vucomiss xmm3,xmm5
2490 mov    eax,0x1
2495 sbb    eax,0xffffffff
2498 xor    esi,esi
249a vucomiss xmm4,xmm5
249e setb   sil
24a2 vucomiss xmm3,xmm4
24a6 cmovae esi,eax
24a9 lea    eax,[rsi+0x1]
24ac vucomiss xmm3,xmm5
24b0 mov    edi,eax
24b2 cmovae edi,r10d
24b6 vucomiss xmm3,xmm4
24ba cmovb  edi,eax
24bd vmovmskps eax,xmm0
24c1 shl    eax,0x1f
24c4 or     eax,0x1e3ce508
24c9 vmovd  xmm5,eax
24cd vmovss xmm6,DWORD PTR [rip+0x1b37]
24d5 vcmpltss xmm3,xmm6,xmm3
24da vblendvps xmm3,xmm5,xmm0,xmm3
24e0 vdivss xmm5,xmm9,xmm3
24e4 vpbroadcastd xmm3,DWORD PTR [r9+rbx*1+0x1c]
24eb mov    rbx,r15
24ee vmovaps XMMWORD PTR [rsp+rcx*1+0x580],xmm1
24f7 vcmpltps xmm4,xmm10,xmm4
24fc vandps xmm6,xmm11,xmm2
2500 vorps  xmm6,xmm12,xmm6
2504 vblendvps xmm4,xmm6,xmm2,xmm4
250a vdivps xmm4,xmm13,xmm4
250e vmovlps QWORD PTR [rsp+rcx*1+0x590],xmm4
2517 vmovss DWORD PTR [rsp+rcx*1+0x598],xmm5
2520 vmulps xmm6,xmm14,xmm4
2524 vmovlps QWORD PTR [rsp+rcx*1+0x59c],xmm6
252d vmulss xmm6,xmm15,xmm5
2531 vmovss DWORD PTR [rsp+rcx*1+0x5a4],xmm6
253a lea    eax,[r8+0x10]
253e mov    DWORD PTR [rsp+0x3c],eax
2542 or     r8d,0x2
2546 xor    eax,eax
2548 vxorps xmm6,xmm6,xmm6
254c vucomiss xmm6,xmm4
2550 seta   al
2553 vmovshdup xmm4,xmm4
2557 vinsertps xmm4,xmm4,xmm5,0x10
255d mov    DWORD PTR [rsp+rcx*1+0x5a8],eax
2564 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x1ac3]
256d vpsubd xmm4,xmm8,xmm4
2571 vmovq  QWORD PTR [rsp+rcx*1+0x5ac],xmm4
257a vmovlps QWORD PTR [rsp+rdx*1+0x100],xmm2
2583 lea    eax,[rdi+0x1]
2586 cmp    edi,0x2
2589 cmove  eax,r10d
258d vmovss DWORD PTR [rsp+rdx*1+0x108],xmm0
2596 vmovlps QWORD PTR [rsp+rdx*1+0x180],xmm1
259f mov    DWORD PTR [rsp+rcx*1+0x5bc],esi
25a6 vextractps DWORD PTR [rsp+rdx*1+0x188],xmm1,0x2
25b1 shl    rsi,0x2
25b5 mov    rdx,r14
25b8 or     rdx,rsi
25bb vdivss xmm0,xmm9,DWORD PTR [rdx]
25bf mov    DWORD PTR [rsp+rcx*1+0x5b4],edi
25c6 mov    DWORD PTR [rsp+rcx*1+0x5b8],eax
25cd vmovss DWORD PTR [rsp+rcx*1+0x5c8],xmm0
25d6 vmulss xmm1,xmm0,DWORD PTR [r14+rdi*4]
25dc vmovss DWORD PTR [rsp+rcx*1+0x5c0],xmm1
25e5 mov    QWORD PTR [rsp+0x60],r14
25ea vmulss xmm0,xmm0,DWORD PTR [r14+rax*4]
25f0 vmovss DWORD PTR [rsp+rcx*1+0x5c4],xmm0
25f9 vmovss xmm0,DWORD PTR [r12+rdi*4]
25ff vmovss DWORD PTR [rsp+rcx*1+0x5cc],xmm0
2608 vmovss xmm0,DWORD PTR [r12+rax*4]
260e vmovss DWORD PTR [rsp+rcx*1+0x5d0],xmm0
2617 mov    QWORD PTR [rsp+0x58],r12
261c or     rsi,r12
261f vmovss xmm0,DWORD PTR [rsi]
2623 vmovss DWORD PTR [rsp+rcx*1+0x5d4],xmm0
262c vmovq  rax,xmm3
2631 vmovq  xmm0,rax
2636 vmovdqu XMMWORD PTR [rsp+rcx*1+0x5d8],xmm0
263f lea    r14,[rsp+rcx*1+0x200]
2647 lea    r15,[rsp+rcx*1]
264b add    r15,0x580
2652 mov    DWORD PTR [rsp+rcx*1+0x5e8],0xffffffff
265d mov    QWORD PTR [rsp+0xe8],r11
2665 imul   rax,r11,0xac0
266c lea    rcx,[rsp+rax*1]
2670 add    rcx,0x900
2677 mov    QWORD PTR [rsp+0x78],rcx
267c add    rax,rsp
267f add    rax,0x5f00
2685 mov    QWORD PTR [rsp+0x68],rax
268a mov    DWORD PTR [r15+0x6c],ebx
268e mov    ebx,r8d
2691 mov    r13,QWORD PTR [rsp+0x40]
2696 mov    r12,QWORD PTR [rsp+0x70]
269b jmp    289c <_pocl_kernel_closest_workgroup+0x77c>
26a0 mov    edx,ebx
26a2 shl    rdx,0x5
26a6 mov    rdi,QWORD PTR [rsp+0x48]
26ab vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
26b1 vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
26ba vandps xmm3,xmm0,xmm4
26be vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
26c3 vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
26c9 vandps xmm4,xmm2,xmm4
26cd vpermilps xmm5,xmm4,0xf5
26d3 vucomiss xmm3,xmm5
26d7 mov    ecx,0x1
26dc sbb    ecx,0xffffffff
26df xor    eax,eax
26e1 vucomiss xmm4,xmm5
26e5 setb   al
26e8 vucomiss xmm3,xmm4
26ec cmovae eax,ecx
26ef lea    esi,[rax+0x1]
26f2 vucomiss xmm3,xmm5
26f6 mov    ecx,esi
26f8 mov    r8d,0x0
26fe cmovae ecx,r8d
2702 vucomiss xmm3,xmm4
2706 cmovb  ecx,esi
2709 vmovmskps esi,xmm0
270d shl    esi,0x1f
2710 or     esi,0x1e3ce508
2716 vmovd  xmm5,esi
271a vmovss xmm6,DWORD PTR [rip+0x18ea]
2722 vcmpltss xmm3,xmm6,xmm3
2727 vblendvps xmm3,xmm5,xmm0,xmm3
272d vmovss xmm7,DWORD PTR [rip+0x18cb]
2735 vdivss xmm5,xmm7,xmm3
2739 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
2740 vmovaps XMMWORD PTR [r14],xmm1
2745 vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
274e vcmpltps xmm4,xmm6,xmm4
2753 vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
275c vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
2765 vblendvps xmm4,xmm6,xmm2,xmm4
276b vmovaps xmm6,XMMWORD PTR [rsp+0x90]
2774 vdivps xmm4,xmm6,xmm4
2778 vmovlps QWORD PTR [r14+0x10],xmm4
277e vmovss DWORD PTR [r14+0x18],xmm5
2784 vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
278d vmovlps QWORD PTR [r14+0x1c],xmm6
2793 vmulss xmm6,xmm5,DWORD PTR [rip+0x1875]
279b vmovss DWORD PTR [r14+0x24],xmm6
27a1 xor    edx,edx
27a3 vxorps xmm6,xmm6,xmm6
27a7 vucomiss xmm6,xmm4
27ab seta   dl
27ae vmovshdup xmm4,xmm4
27b2 vinsertps xmm4,xmm4,xmm5,0x10
27b8 mov    DWORD PTR [r14+0x28],edx
27bc vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x186b]
27c5 vmovdqa xmm5,XMMWORD PTR [rip+0x1853]
27cd vpsubd xmm4,xmm5,xmm4
27d1 vmovq  QWORD PTR [r14+0x2c],xmm4
27d7 mov    rdi,QWORD PTR [rsp+0x60]
27dc vmovlps QWORD PTR [rdi],xmm2
27e0 mov    DWORD PTR [r14+0x3c],eax
27e4 mov    DWORD PTR [r14+0x34],ecx
27e8 lea    edx,[rcx+0x1]
27eb cmp    ecx,0x2
27ee cmove  edx,r8d
27f2 mov    r8,rbx
27f5 mov    rbx,QWORD PTR [rsp+0x58]
27fa vmovlps QWORD PTR [rbx],xmm1
27fe mov    DWORD PTR [r14+0x38],edx
2802 vextractps DWORD PTR [rbx+0x8],xmm1,0x2
2809 vmovss DWORD PTR [rdi+0x8],xmm0
280e shl    rax,0x2
2812 mov    rsi,rdi
2815 or     rsi,rax
2818 vdivss xmm0,xmm7,DWORD PTR [rsi]
281c vmovss DWORD PTR [r14+0x48],xmm0
2822 vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
2827 vmovss DWORD PTR [r14+0x40],xmm1
282d vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
2832 vmovss DWORD PTR [r14+0x44],xmm0
2838 vmovss xmm0,DWORD PTR [rbx+rcx*4]
283d vmovss DWORD PTR [r14+0x4c],xmm0
2843 vmovss xmm0,DWORD PTR [rbx+rdx*4]
2848 vmovss DWORD PTR [r14+0x50],xmm0
284e or     rax,rbx
2851 vmovd  xmm0,DWORD PTR [rax]
2855 vmovd  DWORD PTR [r14+0x54],xmm0
285b vmovq  QWORD PTR [r14+0x58],xmm3
2861 mov    QWORD PTR [r14+0x60],0x0
2869 mov    DWORD PTR [r14+0x68],0xffffffff
2871 mov    DWORD PTR [r14+0x6c],r8d
2875 lea    eax,[r8+0x1]
2879 mov    ebx,eax
287b mov    r13,QWORD PTR [rsp+0x40]
2880 mov    rdi,r13
2883 mov    r12,QWORD PTR [rsp+0x70]
2888 mov    rsi,r12
288b mov    rdx,r15
288e mov    rcx,QWORD PTR [rsp+0x68]
2893 call   1300 <wide8_step>
2898 test   eax,eax
289a je     28e0 <_pocl_kernel_closest_workgroup+0x7c0>
289c mov    rdi,r13
289f mov    rsi,r12
28a2 mov    rdx,r14
28a5 mov    rcx,QWORD PTR [rsp+0x78]
28aa call   1300 <wide8_step>
28af test   eax,eax
28b1 jne    287b <_pocl_kernel_closest_workgroup+0x75b>
28b3 mov    rdi,r12
28b6 mov    rsi,r14
28b9 mov    rdx,QWORD PTR [rsp+0x50]
28be call   1160 <wide8_end>
28c3 cmp    ebx,DWORD PTR [rsp+0x3c]
28c7 jb     26a0 <_pocl_kernel_closest_workgroup+0x580>
28cd jmp    2b00 <_pocl_kernel_closest_workgroup+0x9e0>
28d2 data16 data16 data16 data16 cs nop WORD PTR [rax+rax*1+0x0]
28e0 mov    rdi,r12
28e3 mov    rsi,r15
28e6 mov    rdx,QWORD PTR [rsp+0x50]
28eb call   1160 <wide8_end>
28f0 cmp    ebx,DWORD PTR [rsp+0x3c]
28f4 jae    2ae0 <_pocl_kernel_closest_workgroup+0x9c0>
28fa mov    edx,ebx
28fc shl    rdx,0x5
2900 mov    rdi,QWORD PTR [rsp+0x48]
2905 vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
290b vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
2914 vandps xmm3,xmm0,xmm4
2918 vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
291d vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
2923 vandps xmm4,xmm2,xmm4
2927 vpermilps xmm5,xmm4,0xf5
292d vucomiss xmm3,xmm5
2931 mov    ecx,0x1
2936 sbb    ecx,0xffffffff
2939 xor    eax,eax
293b vucomiss xmm4,xmm5
293f setb   al
2942 vucomiss xmm3,xmm4
2946 cmovae eax,ecx
2949 lea    esi,[rax+0x1]
294c vucomiss xmm3,xmm5
2950 mov    ecx,esi
2952 mov    r8d,0x0
2958 cmovae ecx,r8d
295c vucomiss xmm3,xmm4
2960 cmovb  ecx,esi
2963 vmovmskps esi,xmm0
2967 shl    esi,0x1f
296a or     esi,0x1e3ce508
2970 vmovd  xmm5,esi
2974 vmovss xmm6,DWORD PTR [rip+0x1690]
297c vcmpltss xmm3,xmm6,xmm3
2981 vblendvps xmm3,xmm5,xmm0,xmm3
2987 vmovss xmm7,DWORD PTR [rip+0x1671]
298f vdivss xmm5,xmm7,xmm3
2993 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
299a vmovaps XMMWORD PTR [r15],xmm1
299f vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
29a8 vcmpltps xmm4,xmm6,xmm4
29ad vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
29b6 vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
29bf vblendvps xmm4,xmm6,xmm2,xmm4
29c5 vmovaps xmm6,XMMWORD PTR [rsp+0x90]
29ce vdivps xmm4,xmm6,xmm4
29d2 vmovlps QWORD PTR [r15+0x10],xmm4
29d8 vmovss DWORD PTR [r15+0x18],xmm5
29de vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
29e7 vmovlps QWORD PTR [r15+0x1c],xmm6
29ed vmulss xmm6,xmm5,DWORD PTR [rip+0x161b]
29f5 vmovss DWORD PTR [r15+0x24],xmm6
29fb xor    edx,edx
29fd vxorps xmm6,xmm6,xmm6
2a01 vucomiss xmm6,xmm4
2a05 seta   dl
2a08 vmovshdup xmm4,xmm4
2a0c vinsertps xmm4,xmm4,xmm5,0x10
2a12 mov    DWORD PTR [r15+0x28],edx
2a16 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x1611]
2a1f vmovdqa xmm5,XMMWORD PTR [rip+0x15f9]
2a27 vpsubd xmm4,xmm5,xmm4
2a2b vmovq  QWORD PTR [r15+0x2c],xmm4
2a31 mov    rdi,QWORD PTR [rsp+0x60]
2a36 vmovlps QWORD PTR [rdi],xmm2
2a3a mov    DWORD PTR [r15+0x3c],eax
2a3e mov    DWORD PTR [r15+0x34],ecx
2a42 lea    edx,[rcx+0x1]
2a45 cmp    ecx,0x2
2a48 cmove  edx,r8d
2a4c mov    r8,rbx
2a4f mov    rbx,QWORD PTR [rsp+0x58]
2a54 vmovlps QWORD PTR [rbx],xmm1
2a58 mov    DWORD PTR [r15+0x38],edx
2a5c vextractps DWORD PTR [rbx+0x8],xmm1,0x2
2a63 vmovss DWORD PTR [rdi+0x8],xmm0
2a68 shl    rax,0x2
2a6c mov    rsi,rdi
2a6f or     rsi,rax
2a72 vdivss xmm0,xmm7,DWORD PTR [rsi]
2a76 vmovss DWORD PTR [r15+0x48],xmm0
2a7c vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
2a81 vmovss DWORD PTR [r15+0x40],xmm1
2a87 vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
2a8c vmovss DWORD PTR [r15+0x44],xmm0
2a92 vmovss xmm0,DWORD PTR [rbx+rcx*4]
2a97 vmovss DWORD PTR [r15+0x4c],xmm0
2a9d vmovss xmm0,DWORD PTR [rbx+rdx*4]
2aa2 vmovss DWORD PTR [r15+0x50],xmm0
2aa8 or     rax,rbx
2aab mov    rbx,r8
2aae vmovd  xmm0,DWORD PTR [rax]
2ab2 vmovd  DWORD PTR [r15+0x54],xmm0
2ab8 vmovq  QWORD PTR [r15+0x58],xmm3
2abe inc    r8d
2ac1 mov    QWORD PTR [r15+0x60],0x0
2ac9 mov    DWORD PTR [r15+0x68],0xffffffff
2ad1 jmp    268a <_pocl_kernel_closest_workgroup+0x56a>
2ad6 cs nop WORD PTR [rax+rax*1+0x0]
2ae0 mov    rdi,QWORD PTR [rsp+0x40]
2ae5 mov    rsi,r12
2ae8 mov    rdx,r14
2aeb mov    rcx,QWORD PTR [rsp+0x78]
2af0 call   1300 <wide8_step>
2af5 test   eax,eax
2af7 jne    2ae0 <_pocl_kernel_closest_workgroup+0x9c0>
2af9 mov    r15,r14
2afc jmp    2b25 <_pocl_kernel_closest_workgroup+0xa05>
2afe xchg   ax,ax
2b00 mov    r14,QWORD PTR [rsp+0x40]
2b05 mov    rbx,QWORD PTR [rsp+0x68]
2b0a nop    WORD PTR [rax+rax*1+0x0]
2b10 mov    rdi,r14
2b13 mov    rsi,r12
2b16 mov    rdx,r15
2b19 mov    rcx,rbx
2b1c call   1300 <wide8_step>
2b21 test   eax,eax
2b23 jne    2b10 <_pocl_kernel_closest_workgroup+0x9f0>
2b25 mov    rdi,r12
2b28 mov    rsi,r15
2b2b mov    rdx,QWORD PTR [rsp+0x50]
2b30 call   1160 <wide8_end>
2b35 mov    r11,QWORD PTR [rsp+0xe8]
2b3d inc    r11
2b40 cmp    r11,0x8
2b44 jne    2200 <_pocl_kernel_closest_workgroup+0xe0>
2b4a lea    rsp,[rbp-0x28]
2b4e pop    rbx
2b4f pop    r12
2b51 pop    r13
2b53 pop    r14
2b55 pop    r15
2b57 pop    rbp
2b58 ret
2b59 nop    DWORD PTR [rax+0x0]

0000000000002b60 <_pocl_kernel_closest_workgroup_fast>:
2b60 push   rbp
2b61 mov    rbp,rsp
2b64 push   r15
2b66 push   r14
2b68 push   r13
2b6a push   r12
2b6c push   rbx
2b6d and    rsp,0xffffffffffffffc0
2b71 sub    rsp,0xb540
2b78 mov    r14,QWORD PTR [rdi]
2b7b mov    r12,QWORD PTR [rdi+0x8]
2b7f mov    rax,QWORD PTR [rdi+0x10]
2b83 mov    QWORD PTR [rsp+0x48],rax
2b88 mov    rax,QWORD PTR [rdi+0x18]
2b8c mov    QWORD PTR [rsp+0x50],rax
2b91 shl    rdx,0x3
2b95 mov    QWORD PTR [rsp+0xe0],rdx
2b9d vbroadcastss xmm0,DWORD PTR [rip+0x1462]
2ba6 vmovaps XMMWORD PTR [rsp+0xd0],xmm0
2baf vbroadcastss xmm0,DWORD PTR [rip+0x1454]
2bb8 vmovaps XMMWORD PTR [rsp+0xc0],xmm0
2bc1 vbroadcastss xmm0,DWORD PTR [rip+0x143a]
2bca vmovaps XMMWORD PTR [rsp+0xb0],xmm0
2bd3 vbroadcastss xmm0,DWORD PTR [rip+0x1430]
2bdc vmovaps XMMWORD PTR [rsp+0xa0],xmm0
2be5 vbroadcastss xmm0,DWORD PTR [rip+0x1412]
2bee vmovaps XMMWORD PTR [rsp+0x90],xmm0
2bf7 vbroadcastss xmm0,DWORD PTR [rip+0x1410]
2c00 vmovaps XMMWORD PTR [rsp+0x80],xmm0
2c09 vpbroadcastq xmm0,QWORD PTR [rip+0x1406]
2c12 vmovdqa XMMWORD PTR [rsp+0xf0],xmm0
2c1b xor    r11d,r11d
2c1e mov    QWORD PTR [rsp+0x40],r14
2c23 mov    QWORD PTR [rsp+0x70],r12
2c28 nop    DWORD PTR [rax+rax*1+0x0]
2c30 mov    rax,QWORD PTR [rsp+0xe0]
2c38 lea    r8d,[r11+rax*1]
2c3c shl    r8d,0x4
2c40 mov    rdx,r8
2c43 shl    rdx,0x5
2c47 mov    r9,QWORD PTR [rsp+0x48]
2c4c vmovss xmm0,DWORD PTR [r9+rdx*1+0x18]
2c53 vmovaps xmm7,XMMWORD PTR [rsp+0xd0]
2c5c vandps xmm2,xmm0,xmm7
2c60 vmovaps xmm1,XMMWORD PTR [r9+rdx*1+0x10]
2c67 vandps xmm4,xmm1,xmm7
2c6b vpermilps xmm3,xmm4,0xf5
2c71 vucomiss xmm2,xmm3
2c75 mov    ecx,0x1
2c7a sbb    ecx,0xffffffff
2c7d xor    esi,esi
2c7f vucomiss xmm4,xmm3
2c83 setb   sil
2c87 vucomiss xmm2,xmm4
2c8b cmovae esi,ecx
2c8e lea    ecx,[rsi+0x1]
2c91 vucomiss xmm2,xmm3
2c95 mov    edi,ecx
2c97 mov    r10d,0x0
2c9d cmovae edi,r10d
2ca1 vucomiss xmm2,xmm4
2ca5 vmovmskps ebx,xmm0
2ca9 cmovb  edi,ecx
2cac shl    ebx,0x1f
2caf or     ebx,0x1e3ce508
2cb5 vmovd  xmm3,ebx
2cb9 vmovss xmm8,DWORD PTR [rip+0x134b]
2cc1 vcmpltss xmm2,xmm8,xmm2
2cc6 vblendvps xmm2,xmm3,xmm0,xmm2
2ccc vmovaps xmm3,XMMWORD PTR [r9+rdx*1]
2cd2 vmovss xmm9,DWORD PTR [rip+0x1326]
2cda vdivss xmm5,xmm9,xmm2
2cde imul   rcx,r11,0x70
2ce2 vpbroadcastd xmm2,DWORD PTR [r9+rdx*1+0x1c]
2ce9 vmovaps XMMWORD PTR [rsp+rcx*1+0x200],xmm3
2cf2 vmovaps xmm10,XMMWORD PTR [rsp+0xc0]
2cfb vcmpltps xmm4,xmm10,xmm4
2d00 vmovaps xmm11,XMMWORD PTR [rsp+0xb0]
2d09 vandps xmm6,xmm11,xmm1
2d0d vmovaps xmm12,XMMWORD PTR [rsp+0xa0]
2d16 vorps  xmm6,xmm12,xmm6
2d1a vblendvps xmm4,xmm6,xmm1,xmm4
2d20 vmovaps xmm13,XMMWORD PTR [rsp+0x90]
2d29 vdivps xmm4,xmm13,xmm4
2d2d vmovlps QWORD PTR [rsp+rcx*1+0x210],xmm4
2d36 vmovss DWORD PTR [rsp+rcx*1+0x218],xmm5
2d3f vmovaps xmm14,XMMWORD PTR [rsp+0x80]
2d48 vmulps xmm6,xmm14,xmm4
2d4c vmovlps QWORD PTR [rsp+rcx*1+0x21c],xmm6
2d55 vmovss xmm15,DWORD PTR [rip+0x12b3]
2d5d vmulss xmm6,xmm15,xmm5
2d61 vmovss DWORD PTR [rsp+rcx*1+0x224],xmm6
2d6a xor    edx,edx
2d6c vxorps xmm6,xmm6,xmm6
2d70 vucomiss xmm6,xmm4
2d74 seta   dl
2d77 mov    DWORD PTR [rsp+rcx*1+0x228],edx
2d7e vmovshdup xmm4,xmm4
2d82 vinsertps xmm4,xmm4,xmm5,0x10
2d88 vxorps xmm5,xmm5,xmm5
2d8c vcmpltps xmm4,xmm4,xmm5
2d91 vmovdqa xmm8,XMMWORD PTR [rsp+0xf0]
2d9a vpsubd xmm4,xmm8,xmm4
2d9e vmovq  QWORD PTR [rsp+rcx*1+0x22c],xmm4
2da7 mov    DWORD PTR [rsp+rcx*1+0x23c],esi
2dae mov    DWORD PTR [rsp+rcx*1+0x234],edi
2db5 lea    ebx,[rdi+0x1]
2db8 cmp    edi,0x2
2dbb cmove  ebx,r10d
2dbf mov    DWORD PTR [rsp+rcx*1+0x238],ebx
2dc6 mov    rdx,r11
2dc9 shl    rdx,0x4
2dcd vmovlps QWORD PTR [rsp+rdx*1+0x100],xmm1
2dd6 vmovlps QWORD PTR [rsp+rdx*1+0x180],xmm3
2ddf lea    r14,[rsp+rdx*1]
2de3 add    r14,0x100
2dea vextractps DWORD PTR [rsp+rdx*1+0x188],xmm3,0x2
2df5 vmovss DWORD PTR [rsp+rdx*1+0x108],xmm0
2dfe shl    rsi,0x2
2e02 mov    rax,r14
2e05 or     rax,rsi
2e08 vdivss xmm0,xmm9,DWORD PTR [rax]
2e0c vmovss DWORD PTR [rsp+rcx*1+0x248],xmm0
2e15 vmulss xmm1,xmm0,DWORD PTR [r14+rdi*4]
2e1b vmovss DWORD PTR [rsp+rcx*1+0x240],xmm1
2e24 vmulss xmm0,xmm0,DWORD PTR [r14+rbx*4]
2e2a vmovss DWORD PTR [rsp+rcx*1+0x244],xmm0
2e33 lea    r12,[rsp+rdx*1+0x180]
2e3b vmovss xmm0,DWORD PTR [r12+rdi*4]
2e41 vmovss DWORD PTR [rsp+rcx*1+0x24c],xmm0
2e4a vmovss xmm0,DWORD PTR [r12+rbx*4]
2e50 vmovss DWORD PTR [rsp+rcx*1+0x250],xmm0
2e59 or     rsi,r12
2e5c vmovss xmm0,DWORD PTR [rsi]
2e60 vmovss DWORD PTR [rsp+rcx*1+0x254],xmm0
2e69 vmovq  rax,xmm2
2e6e vmovq  xmm0,rax
2e73 vmovdqu XMMWORD PTR [rsp+rcx*1+0x258],xmm0
2e7c lea    r15d,[r8+0x1]
2e80 mov    DWORD PTR [rsp+rcx*1+0x268],0xffffffff
2e8b mov    DWORD PTR [rsp+rcx*1+0x26c],r8d
2e93 mov    rbx,r15
2e96 shl    rbx,0x5
2e9a vmovss xmm0,DWORD PTR [r9+rbx*1+0x18]
2ea1 vandps xmm3,xmm0,xmm7
2ea5 vmovaps xmm1,XMMWORD PTR [r9+rbx*1]
2eab vmovaps xmm2,XMMWORD PTR [r9+rbx*1+0x10]
2eb2 vandps xmm4,xmm2,xmm7
2eb6 vpermilps xmm5,xmm4,0xf5
2ebc vucomiss xmm3,xmm5
2ec0 mov    eax,0x1
2ec5 sbb    eax,0xffffffff
2ec8 xor    esi,esi
2eca vucomiss xmm4,xmm5
2ece setb   sil
2ed2 vucomiss xmm3,xmm4
2ed6 cmovae esi,eax
2ed9 lea    eax,[rsi+0x1]
2edc vucomiss xmm3,xmm5
2ee0 mov    edi,eax
2ee2 cmovae edi,r10d
2ee6 vucomiss xmm3,xmm4
2eea cmovb  edi,eax
2eed vmovmskps eax,xmm0
2ef1 shl    eax,0x1f
2ef4 or     eax,0x1e3ce508
2ef9 vmovd  xmm5,eax
2efd vmovss xmm6,DWORD PTR [rip+0x1107]
2f05 vcmpltss xmm3,xmm6,xmm3
2f0a vblendvps xmm3,xmm5,xmm0,xmm3
2f10 vdivss xmm5,xmm9,xmm3
2f14 vpbroadcastd xmm3,DWORD PTR [r9+rbx*1+0x1c]
2f1b mov    rbx,r15
2f1e vmovaps XMMWORD PTR [rsp+rcx*1+0x580],xmm1
2f27 vcmpltps xmm4,xmm10,xmm4
2f2c vandps xmm6,xmm11,xmm2
2f30 vorps  xmm6,xmm12,xmm6
2f34 vblendvps xmm4,xmm6,xmm2,xmm4
2f3a vdivps xmm4,xmm13,xmm4
2f3e vmovlps QWORD PTR [rsp+rcx*1+0x590],xmm4
2f47 vmovss DWORD PTR [rsp+rcx*1+0x598],xmm5
2f50 vmulps xmm6,xmm14,xmm4
2f54 vmovlps QWORD PTR [rsp+rcx*1+0x59c],xmm6
2f5d vmulss xmm6,xmm15,xmm5
2f61 vmovss DWORD PTR [rsp+rcx*1+0x5a4],xmm6
2f6a lea    eax,[r8+0x10]
2f6e mov    DWORD PTR [rsp+0x3c],eax
2f72 or     r8d,0x2
2f76 xor    eax,eax
2f78 vxorps xmm6,xmm6,xmm6
2f7c vucomiss xmm6,xmm4
2f80 seta   al
2f83 vmovshdup xmm4,xmm4
2f87 vinsertps xmm4,xmm4,xmm5,0x10
2f8d mov    DWORD PTR [rsp+rcx*1+0x5a8],eax
2f94 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0x1093]
2f9d vpsubd xmm4,xmm8,xmm4
2fa1 vmovq  QWORD PTR [rsp+rcx*1+0x5ac],xmm4
2faa vmovlps QWORD PTR [rsp+rdx*1+0x100],xmm2
2fb3 lea    eax,[rdi+0x1]
2fb6 cmp    edi,0x2
2fb9 cmove  eax,r10d
2fbd vmovss DWORD PTR [rsp+rdx*1+0x108],xmm0
2fc6 vmovlps QWORD PTR [rsp+rdx*1+0x180],xmm1
2fcf mov    DWORD PTR [rsp+rcx*1+0x5bc],esi
2fd6 vextractps DWORD PTR [rsp+rdx*1+0x188],xmm1,0x2
2fe1 shl    rsi,0x2
2fe5 mov    rdx,r14
2fe8 or     rdx,rsi
2feb vdivss xmm0,xmm9,DWORD PTR [rdx]
2fef mov    DWORD PTR [rsp+rcx*1+0x5b4],edi
2ff6 mov    DWORD PTR [rsp+rcx*1+0x5b8],eax
2ffd vmovss DWORD PTR [rsp+rcx*1+0x5c8],xmm0
3006 vmulss xmm1,xmm0,DWORD PTR [r14+rdi*4]
300c vmovss DWORD PTR [rsp+rcx*1+0x5c0],xmm1
3015 mov    QWORD PTR [rsp+0x60],r14
301a vmulss xmm0,xmm0,DWORD PTR [r14+rax*4]
3020 vmovss DWORD PTR [rsp+rcx*1+0x5c4],xmm0
3029 vmovss xmm0,DWORD PTR [r12+rdi*4]
302f vmovss DWORD PTR [rsp+rcx*1+0x5cc],xmm0
3038 vmovss xmm0,DWORD PTR [r12+rax*4]
303e vmovss DWORD PTR [rsp+rcx*1+0x5d0],xmm0
3047 mov    QWORD PTR [rsp+0x58],r12
304c or     rsi,r12
304f vmovss xmm0,DWORD PTR [rsi]
3053 vmovss DWORD PTR [rsp+rcx*1+0x5d4],xmm0
305c vmovq  rax,xmm3
3061 vmovq  xmm0,rax
3066 vmovdqu XMMWORD PTR [rsp+rcx*1+0x5d8],xmm0
306f lea    r14,[rsp+rcx*1+0x200]
3077 lea    r15,[rsp+rcx*1]
307b add    r15,0x580
3082 mov    DWORD PTR [rsp+rcx*1+0x5e8],0xffffffff
308d mov    QWORD PTR [rsp+0xe8],r11
3095 imul   rax,r11,0xac0
309c lea    rcx,[rsp+rax*1]
30a0 add    rcx,0x900
30a7 mov    QWORD PTR [rsp+0x78],rcx
30ac add    rax,rsp
30af add    rax,0x5f00
30b5 mov    QWORD PTR [rsp+0x68],rax
30ba mov    DWORD PTR [r15+0x6c],ebx
30be mov    ebx,r8d
30c1 mov    r13,QWORD PTR [rsp+0x40]
30c6 mov    r12,QWORD PTR [rsp+0x70]
30cb jmp    32cc <_pocl_kernel_closest_workgroup_fast+0x76c>
30d0 mov    edx,ebx
30d2 shl    rdx,0x5
30d6 mov    rdi,QWORD PTR [rsp+0x48]
30db vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
30e1 vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
30ea vandps xmm3,xmm0,xmm4
30ee vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
30f3 vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
30f9 vandps xmm4,xmm2,xmm4
30fd vpermilps xmm5,xmm4,0xf5
3103 vucomiss xmm3,xmm5
3107 mov    ecx,0x1
310c sbb    ecx,0xffffffff
310f xor    eax,eax
3111 vucomiss xmm4,xmm5
3115 setb   al
3118 vucomiss xmm3,xmm4
311c cmovae eax,ecx
311f lea    esi,[rax+0x1]
3122 vucomiss xmm3,xmm5
3126 mov    ecx,esi
3128 mov    r8d,0x0
312e cmovae ecx,r8d
3132 vucomiss xmm3,xmm4
3136 cmovb  ecx,esi
3139 vmovmskps esi,xmm0
313d shl    esi,0x1f
3140 or     esi,0x1e3ce508
3146 vmovd  xmm5,esi
314a vmovss xmm6,DWORD PTR [rip+0xeba]
3152 vcmpltss xmm3,xmm6,xmm3
3157 vblendvps xmm3,xmm5,xmm0,xmm3
315d vmovss xmm7,DWORD PTR [rip+0xe9b]
3165 vdivss xmm5,xmm7,xmm3
3169 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
3170 vmovaps XMMWORD PTR [r14],xmm1
3175 vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
317e vcmpltps xmm4,xmm6,xmm4
3183 vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
318c vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
3195 vblendvps xmm4,xmm6,xmm2,xmm4
319b vmovaps xmm6,XMMWORD PTR [rsp+0x90]
31a4 vdivps xmm4,xmm6,xmm4
31a8 vmovlps QWORD PTR [r14+0x10],xmm4
31ae vmovss DWORD PTR [r14+0x18],xmm5
31b4 vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
31bd vmovlps QWORD PTR [r14+0x1c],xmm6
31c3 vmulss xmm6,xmm5,DWORD PTR [rip+0xe45]
31cb vmovss DWORD PTR [r14+0x24],xmm6
31d1 xor    edx,edx
31d3 vxorps xmm6,xmm6,xmm6
31d7 vucomiss xmm6,xmm4
31db seta   dl
31de vmovshdup xmm4,xmm4
31e2 vinsertps xmm4,xmm4,xmm5,0x10
31e8 mov    DWORD PTR [r14+0x28],edx
31ec vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0xe3b]
31f5 vmovdqa xmm5,XMMWORD PTR [rip+0xe23]
31fd vpsubd xmm4,xmm5,xmm4
3201 vmovq  QWORD PTR [r14+0x2c],xmm4
3207 mov    rdi,QWORD PTR [rsp+0x60]
320c vmovlps QWORD PTR [rdi],xmm2
3210 mov    DWORD PTR [r14+0x3c],eax
3214 mov    DWORD PTR [r14+0x34],ecx
3218 lea    edx,[rcx+0x1]
321b cmp    ecx,0x2
321e cmove  edx,r8d
3222 mov    r8,rbx
3225 mov    rbx,QWORD PTR [rsp+0x58]
322a vmovlps QWORD PTR [rbx],xmm1
322e mov    DWORD PTR [r14+0x38],edx
3232 vextractps DWORD PTR [rbx+0x8],xmm1,0x2
3239 vmovss DWORD PTR [rdi+0x8],xmm0
323e shl    rax,0x2
3242 mov    rsi,rdi
3245 or     rsi,rax
3248 vdivss xmm0,xmm7,DWORD PTR [rsi]
324c vmovss DWORD PTR [r14+0x48],xmm0
3252 vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
3257 vmovss DWORD PTR [r14+0x40],xmm1
325d vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
3262 vmovss DWORD PTR [r14+0x44],xmm0
3268 vmovss xmm0,DWORD PTR [rbx+rcx*4]
326d vmovss DWORD PTR [r14+0x4c],xmm0
3273 vmovss xmm0,DWORD PTR [rbx+rdx*4]
3278 vmovss DWORD PTR [r14+0x50],xmm0
327e or     rax,rbx
3281 vmovd  xmm0,DWORD PTR [rax]
3285 vmovd  DWORD PTR [r14+0x54],xmm0
328b vmovq  QWORD PTR [r14+0x58],xmm3
3291 mov    QWORD PTR [r14+0x60],0x0
3299 mov    DWORD PTR [r14+0x68],0xffffffff
32a1 mov    DWORD PTR [r14+0x6c],r8d
32a5 lea    eax,[r8+0x1]
32a9 mov    ebx,eax
32ab mov    r13,QWORD PTR [rsp+0x40]
32b0 mov    rdi,r13
32b3 mov    r12,QWORD PTR [rsp+0x70]
32b8 mov    rsi,r12
32bb mov    rdx,r15
32be mov    rcx,QWORD PTR [rsp+0x68]
32c3 call   1300 <wide8_step>
32c8 test   eax,eax
32ca je     3310 <_pocl_kernel_closest_workgroup_fast+0x7b0>
32cc mov    rdi,r13
32cf mov    rsi,r12
32d2 mov    rdx,r14
32d5 mov    rcx,QWORD PTR [rsp+0x78]
32da call   1300 <wide8_step>
32df test   eax,eax
32e1 jne    32ab <_pocl_kernel_closest_workgroup_fast+0x74b>
32e3 mov    rdi,r12
32e6 mov    rsi,r14
32e9 mov    rdx,QWORD PTR [rsp+0x50]
32ee call   1160 <wide8_end>
32f3 cmp    ebx,DWORD PTR [rsp+0x3c]
32f7 jb     30d0 <_pocl_kernel_closest_workgroup_fast+0x570>
32fd jmp    3530 <_pocl_kernel_closest_workgroup_fast+0x9d0>
3302 data16 data16 data16 data16 cs nop WORD PTR [rax+rax*1+0x0]
3310 mov    rdi,r12
3313 mov    rsi,r15
3316 mov    rdx,QWORD PTR [rsp+0x50]
331b call   1160 <wide8_end>
3320 cmp    ebx,DWORD PTR [rsp+0x3c]
3324 jae    3510 <_pocl_kernel_closest_workgroup_fast+0x9b0>
332a mov    edx,ebx
332c shl    rdx,0x5
3330 mov    rdi,QWORD PTR [rsp+0x48]
3335 vmovss xmm0,DWORD PTR [rdi+rdx*1+0x18]
333b vmovaps xmm4,XMMWORD PTR [rsp+0xd0]
3344 vandps xmm3,xmm0,xmm4
3348 vmovaps xmm1,XMMWORD PTR [rdi+rdx*1]
334d vmovaps xmm2,XMMWORD PTR [rdi+rdx*1+0x10]
3353 vandps xmm4,xmm2,xmm4
3357 vpermilps xmm5,xmm4,0xf5
335d vucomiss xmm3,xmm5
3361 mov    ecx,0x1
3366 sbb    ecx,0xffffffff
3369 xor    eax,eax
336b vucomiss xmm4,xmm5
336f setb   al
3372 vucomiss xmm3,xmm4
3376 cmovae eax,ecx
3379 lea    esi,[rax+0x1]
337c vucomiss xmm3,xmm5
3380 mov    ecx,esi
3382 mov    r8d,0x0
3388 cmovae ecx,r8d
338c vucomiss xmm3,xmm4
3390 cmovb  ecx,esi
3393 vmovmskps esi,xmm0
3397 shl    esi,0x1f
339a or     esi,0x1e3ce508
33a0 vmovd  xmm5,esi
33a4 vmovss xmm6,DWORD PTR [rip+0xc60]
33ac vcmpltss xmm3,xmm6,xmm3
33b1 vblendvps xmm3,xmm5,xmm0,xmm3
33b7 vmovss xmm7,DWORD PTR [rip+0xc41]
33bf vdivss xmm5,xmm7,xmm3
33c3 vpbroadcastd xmm3,DWORD PTR [rdi+rdx*1+0x1c]
33ca vmovaps XMMWORD PTR [r15],xmm1
33cf vmovaps xmm6,XMMWORD PTR [rsp+0xc0]
33d8 vcmpltps xmm4,xmm6,xmm4
33dd vandps xmm6,xmm2,XMMWORD PTR [rsp+0xb0]
33e6 vorps  xmm6,xmm6,XMMWORD PTR [rsp+0xa0]
33ef vblendvps xmm4,xmm6,xmm2,xmm4
33f5 vmovaps xmm6,XMMWORD PTR [rsp+0x90]
33fe vdivps xmm4,xmm6,xmm4
3402 vmovlps QWORD PTR [r15+0x10],xmm4
3408 vmovss DWORD PTR [r15+0x18],xmm5
340e vmulps xmm6,xmm4,XMMWORD PTR [rsp+0x80]
3417 vmovlps QWORD PTR [r15+0x1c],xmm6
341d vmulss xmm6,xmm5,DWORD PTR [rip+0xbeb]
3425 vmovss DWORD PTR [r15+0x24],xmm6
342b xor    edx,edx
342d vxorps xmm6,xmm6,xmm6
3431 vucomiss xmm6,xmm4
3435 seta   dl
3438 vmovshdup xmm4,xmm4
343c vinsertps xmm4,xmm4,xmm5,0x10
3442 mov    DWORD PTR [r15+0x28],edx
3446 vcmpltps xmm4,xmm4,XMMWORD PTR [rip+0xbe1]
344f vmovdqa xmm5,XMMWORD PTR [rip+0xbc9]
3457 vpsubd xmm4,xmm5,xmm4
345b vmovq  QWORD PTR [r15+0x2c],xmm4
3461 mov    rdi,QWORD PTR [rsp+0x60]
3466 vmovlps QWORD PTR [rdi],xmm2
346a mov    DWORD PTR [r15+0x3c],eax
346e mov    DWORD PTR [r15+0x34],ecx
3472 lea    edx,[rcx+0x1]
3475 cmp    ecx,0x2
3478 cmove  edx,r8d
347c mov    r8,rbx
347f mov    rbx,QWORD PTR [rsp+0x58]
3484 vmovlps QWORD PTR [rbx],xmm1
3488 mov    DWORD PTR [r15+0x38],edx
348c vextractps DWORD PTR [rbx+0x8],xmm1,0x2
3493 vmovss DWORD PTR [rdi+0x8],xmm0
3498 shl    rax,0x2
349c mov    rsi,rdi
349f or     rsi,rax
34a2 vdivss xmm0,xmm7,DWORD PTR [rsi]
34a6 vmovss DWORD PTR [r15+0x48],xmm0
34ac vmulss xmm1,xmm0,DWORD PTR [rdi+rcx*4]
34b1 vmovss DWORD PTR [r15+0x40],xmm1
34b7 vmulss xmm0,xmm0,DWORD PTR [rdi+rdx*4]
34bc vmovss DWORD PTR [r15+0x44],xmm0
34c2 vmovss xmm0,DWORD PTR [rbx+rcx*4]
34c7 vmovss DWORD PTR [r15+0x4c],xmm0
34cd vmovss xmm0,DWORD PTR [rbx+rdx*4]
34d2 vmovss DWORD PTR [r15+0x50],xmm0
34d8 or     rax,rbx
34db mov    rbx,r8
34de vmovd  xmm0,DWORD PTR [rax]
34e2 vmovd  DWORD PTR [r15+0x54],xmm0
34e8 vmovq  QWORD PTR [r15+0x58],xmm3
34ee inc    r8d
34f1 mov    QWORD PTR [r15+0x60],0x0
34f9 mov    DWORD PTR [r15+0x68],0xffffffff
3501 jmp    30ba <_pocl_kernel_closest_workgroup_fast+0x55a>
3506 cs nop WORD PTR [rax+rax*1+0x0]
3510 mov    rdi,QWORD PTR [rsp+0x40]
3515 mov    rsi,r12
3518 mov    rdx,r14
351b mov    rcx,QWORD PTR [rsp+0x78]
3520 call   1300 <wide8_step>
3525 test   eax,eax
3527 jne    3510 <_pocl_kernel_closest_workgroup_fast+0x9b0>
3529 mov    r15,r14
352c jmp    3555 <_pocl_kernel_closest_workgroup_fast+0x9f5>
352e xchg   ax,ax
3530 mov    r14,QWORD PTR [rsp+0x40]
3535 mov    rbx,QWORD PTR [rsp+0x68]
353a nop    WORD PTR [rax+rax*1+0x0]
3540 mov    rdi,r14
3543 mov    rsi,r12
3546 mov    rdx,r15
3549 mov    rcx,rbx
354c call   1300 <wide8_step>
3551 test   eax,eax
3553 jne    3540 <_pocl_kernel_closest_workgroup_fast+0x9e0>
3555 mov    rdi,r12
3558 mov    rsi,r15
355b mov    rdx,QWORD PTR [rsp+0x50]
3560 call   1160 <wide8_end>
3565 mov    r11,QWORD PTR [rsp+0xe8]
356d inc    r11
3570 cmp    r11,0x8
3574 jne    2c30 <_pocl_kernel_closest_workgroup_fast+0xd0>
357a lea    rsp,[rbp-0x28]
357e pop    rbx
357f pop    r12
3581 pop    r13
3583 pop    r14
3585 pop    r15
3587 pop    rbp
3588 ret
